"""Named columns, as a file has them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from bayes_hw.errors import InputError

Column: TypeAlias = NDArray[Any]
"""Of shape (samples,): float64 with NaN where nothing was measured, int64, or str for time stamps."""


@dataclass(frozen=True)
class Table:
    """What a reader found of the columns that it was asked for, by the names that were asked.

    `values` holds those asked for, unless some are `missing`. `names` lists every column of the file. `place`
    says where in the file the sample of an index stands, in the words of its format: "row 3" or "sample 2".
    `units` are those that the file itself states. `clocks` holds the stamps of columns with a clock of their
    own, with its unit under `clock_units`. `said` is what a reader decided and a person should know.
    """

    values: Mapping[str, Column]
    missing: tuple[str, ...]
    names: tuple[str, ...]
    kind: Literal["column", "variable", "data set", "channel"]
    place: Callable[[int], str]
    units: Mapping[str, str] = field(default_factory=dict)
    clocks: Mapping[str, Column] = field(default_factory=dict)
    clock_units: Mapping[str, str] = field(default_factory=dict)
    said: tuple[str, ...] = ()


LONGEST_UNIT = 32


def stated_unit(value: object) -> str | None:
    """The unit that an attribute of a file holds as text, if it does."""
    text = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
    short = text.strip() if isinstance(text, str) else ""
    return short if 0 < len(short) <= LONGEST_UNIT and short.isprintable() else None


def numbers(values: object) -> Column:
    """Integers as int64, which holds stamps in ns, anything else as float64; raises ValueError or TypeError
    where there are none."""
    found = np.asarray(values)
    if found.dtype.kind in "iu" and found.dtype.itemsize <= 8:
        return found.astype(np.int64) if found.dtype != np.uint64 else found.astype(np.float64)
    return found.astype(np.float64)


def refuse_infinite(path: object, label: str, kind: str, values: Column, place: Callable[[int], str]) -> None:
    """Raise InputError at the first infinite number."""
    if values.dtype.kind == "f":
        faults = np.flatnonzero(np.isinf(values))
        if len(faults):
            where, what = place(int(faults[0])), f"{kind} {label!r}"
            first, second = (where, what) if kind == "column" else (what, where)
            raise InputError(
                f"{path}: {first}, {second}: {values[faults[0]]} is not a finite number; correct it or "
                "remove it"
            )
