"""One clock in two columns: whole seconds, and what is more in ns, us or ms, as of ROS and of C.

Together they are a column SECONDS+FRACTION, whole numbers of the fraction's unit.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.formats.table import Column, Table

FRACTION = re.compile(
    r"(?P<stem>.*?)(?:(?P<ns>n|nano)|(?P<us>u|micro)|(?P<ms>m|milli))(?:sec(?:ond)?s?)", re.IGNORECASE
)
"""Names of the column of fractions; the seconds beside it are called the same without what is small."""

PER_SECOND = {"ns": 10**9, "us": 10**6, "ms": 10**3}
SECONDS = ("sec", "secs", "second", "seconds")


def halves_of(name: str) -> tuple[str, str] | None:
    """The two columns that `name` says are one clock, None where it is that of one column."""
    first, plus, second = name.rpartition("+")
    return (first, second) if plus and FRACTION.fullmatch(second) else None


def split_clocks(names: Sequence[str]) -> list[str]:
    """The clocks that stand in two of these columns."""
    by_name = {name.casefold(): name for name in names}
    found = []
    for name in names:
        match = FRACTION.fullmatch(name)
        stem = "" if match is None else match["stem"].casefold()
        seconds = next((by_name[stem + word] for word in SECONDS if stem + word in by_name), None)
        if match is not None and seconds is not None:
            found.append(f"{seconds}+{name}")
    return found


def with_split_clocks(table: Table, names: Sequence[str] | None = None) -> Table:
    """The table with its clocks of two columns, all or those of `names`, where these are whole seconds and
    less than a second."""
    for name in split_clocks(list(table.values)) if names is None else names:
        halves = halves_of(name)
        if halves is None or not set(halves) <= set(table.values):
            continue
        seconds, fraction = (table.values[half] for half in halves)
        unit = _unit(halves[1])
        joined = _joined(seconds, fraction, PER_SECOND[unit])
        if joined is not None:
            table = replace(table, values={name: joined, **table.values}, units={**table.units, name: unit})
    return table


def _unit(name: str) -> str:
    match = FRACTION.fullmatch(name)
    assert match is not None
    return next(unit for unit in PER_SECOND if match[unit])


def _joined(seconds: Column, fraction: Column, per_second: int) -> Column | None:
    """Whole numbers of the small unit, None where the columns are no such two."""
    if len(seconds) != len(fraction) or not all(c.dtype.kind in "if" for c in (seconds, fraction)):
        return None
    if not (np.isfinite(seconds).all() and np.isfinite(fraction).all()):
        return None
    whole = bool((seconds == np.round(seconds)).all() and (np.abs(seconds) < 2**33).all())
    small = bool((fraction >= 0).all() and (fraction < per_second).all())
    if not (whole and small):
        return None
    return seconds.astype(np.int64) * per_second + np.round(fraction).astype(np.int64)
