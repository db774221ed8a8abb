"""The noise floor from repeats: what differs between answers to one command no simulator can know.

Records that had the same command repeat each other; so do the periods of a command that is periodic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.record import Record

SAME = 1e-9
"""Of the largest command: differences below it are rounding in a file."""

SETTLING = 1
"""Periods that pass before an axis repeats itself."""

FEWEST_PERIODS = 2
"""After settling."""

SHORTEST_PERIOD = 16
"""Samples; what repeats faster is held against itself at other samples of a motion that hardly moves."""


@dataclass(frozen=True)
class Repeats:
    """Names of the records in question, and the root mean square of what does not repeat, output units.

    `periods` of one record where its command is periodic, not whole records.
    """

    names: tuple[str, ...]
    floor: float
    periods: bool = False


def repeats(records: Sequence[Record]) -> Repeats | None:
    """What differs between records of equal length that had the same command, else between the periods of
    records whose command is periodic; None where there are none.

    Half the mean squared difference of two repeats is the variance of what is new in each: noise, and
    disturbances that no command causes.
    """
    return _of_records(records) or _of_periods(records)


def repeated_floor(records: Sequence[Record]) -> float:
    """The noise that repeats tell to be there at most, output units; infinity where there are none."""
    found = repeats(records)
    return found.floor if found is not None and found.floor > 0 else float("inf")


def _of_records(records: Sequence[Record]) -> Repeats | None:
    squares, samples, names = 0.0, 0, set()
    for one, other in combinations(records, 2):
        if len(one.u) != len(other.u) or not _same(one.u, other.u):
            continue
        squares += 0.5 * float(np.sum((one.y - other.y) ** 2))
        samples += len(one.u)
        names |= {one.name, other.name}
    if not samples:
        return None
    return Repeats(tuple(r.name for r in records if r.name in names), float(np.sqrt(squares / samples)))


def _of_periods(records: Sequence[Record]) -> Repeats | None:
    """Of consecutive periods, less their mean difference: an integrator may creep from one to the next."""
    squares, freedom, names = 0.0, 0, []
    for record in records:
        period = period_of(record.u)
        if period is None:
            continue
        count = len(record.u) // period
        answers = record.y[: count * period].reshape(count, period)[SETTLING:]
        for one, other in pairwise(answers):
            squares += 0.5 * period * float(np.var(other - one))
            freedom += period - 1
        names.append(record.name)
    return Repeats(tuple(names), float(np.sqrt(squares / freedom)), periods=True) if freedom else None


def period_of(command: FloatArray) -> int | None:
    """The shortest period of a command (samples,) that repeats itself often enough, in samples; else None."""
    longest = len(command) // (SETTLING + FEWEST_PERIODS)
    close = np.abs(command[: longest + 1] - command[0]) <= _rounding(command)
    for period in np.flatnonzero(close[SHORTEST_PERIOD:]) + SHORTEST_PERIOD:
        if _same(command[period:], command[:-period]):
            return int(period)
    return None


def _same(one: FloatArray, other: FloatArray) -> bool:
    return bool(np.abs(one - other).max() <= _rounding(one))


def _rounding(command: FloatArray) -> float:
    return SAME * max(float(np.abs(command).max()), 1e-300)
