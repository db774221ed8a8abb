"""One column of a log: extent, unit, empty cells, step of its readings."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.column_roles.reading_step import lattice
from bayes_hw.formats.header import quantity_of, unit_of
from bayes_hw.formats.table import Table
from bayes_hw.formats.text_layout import is_value
from bayes_hw.record_checks import turn_of

MOST_READINGS = 2**17

FEWEST_NUMBERS = 100
"""A column of no more tells nothing of what it is."""


@dataclass(frozen=True)
class ColumnFacts:
    """One column: extent, empty cells, step of its readings and turn at which it wraps (None where there is
    none), unit."""

    name: str
    unit: str | None
    values: FloatArray
    empty: int
    step: float | None
    turn: float | None

    def motion(self, count: int) -> FloatArray:
        """The first numbers, shape (count,), unwrapped, with straight lines across what was not measured."""
        shown = filled(self.values[:count])
        return shown if self.turn is None else np.unwrap(shown, period=self.turn)


def column_facts(name: str, table: Table, values: FloatArray) -> ColumnFacts:
    """What the values of a column, numbers or text, say of it."""
    if values.dtype.kind in "UO":
        return ColumnFacts(name, None, np.zeros(0), len(values), None, None)
    numbers = np.asarray(values, dtype=np.float64)
    shown = numbers[np.isfinite(numbers)]
    return ColumnFacts(
        name,
        table.units.get(name) or unit_of(name),
        numbers,
        len(numbers) - len(shown),
        quantisation_step(shown),
        turn_of(shown),
    )


def no_number(table: Table, names: Collection[str]) -> str | None:
    """The first cell, in a column most of whose cells are numbers, that is none, and where it stands."""
    for name in names:
        cells = table.values[name]
        if cells.dtype.kind not in "UO":
            continue
        is_good = [is_value(str(cell)) or quantity_of(str(cell)) is not None for cell in cells]
        if sum(is_good) > len(is_good) / 2 and not all(is_good):
            at = is_good.index(False)
            return (
                f"{table.place(at)}, {table.kind} {name!r}: {str(cells[at])[:40]!r} is no number as the "
                "others are; correct it or remove the row"
            )
    return None


def quantisation_step(values: FloatArray) -> float | None:
    """The step of which all readings, shape (samples,), are whole multiples apart, printed as finely as they
    may be; None where there is none."""
    step = lattice(values[:MOST_READINGS])
    return None if step is None else float(f"{step:.6g}")


def line_of(facts: ColumnFacts) -> str:
    """The facts as one line to read."""
    shown = facts.values[np.isfinite(facts.values)]
    if len(shown) == 0:
        return f"  {facts.name!r}: text, or nothing"
    words = [f"  {facts.name!r}: {shown.min():.6g} to {shown.max():.6g}"]
    words.append(facts.unit if facts.unit else "no unit stated")
    if facts.step is not None:
        words.append(f"readings in steps of {facts.step:.3g}")
    if facts.empty:
        words.append(f"{facts.empty} empty")
    if np.ptp(shown) == 0:
        words.append("constant")
    if facts.turn is not None:
        words.append(f"wraps: give --unwrap {facts.turn:.15g}")
    return ", ".join(words)


def moves(facts: ColumnFacts) -> bool:
    """Whether the column holds enough numbers, and such that differ."""
    shown = facts.values[np.isfinite(facts.values)]
    return len(shown) > FEWEST_NUMBERS and float(np.ptp(shown)) > 0


def filled(values: FloatArray) -> FloatArray:
    """The numbers, shape (samples,), with straight lines across what was not measured."""
    shown = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), shown, values[shown])
