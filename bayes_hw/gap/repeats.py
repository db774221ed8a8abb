"""The noise floor from repeats: records of one command differ by what no simulator can know."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from bayes_hw.record import Record

SAME = 1e-9
"""Of the largest command: differences below it are rounding in a file."""


@dataclass(frozen=True)
class Repeats:
    """Names of the records in question, and the root mean square of what does not repeat, output units."""

    names: tuple[str, ...]
    floor: float


def repeats(records: Sequence[Record]) -> Repeats | None:
    """What differs between records of equal length that had the same command, None where there are none.

    Half the mean squared difference of two repeats is the variance of what is new in each: noise, and
    disturbances that no command causes.
    """
    squares, samples, names = 0.0, 0, set()
    for one, other in combinations(records, 2):
        if len(one.u) != len(other.u):
            continue
        if np.abs(one.u - other.u).max() > SAME * max(float(np.abs(one.u).max()), 1e-300):
            continue
        squares += 0.5 * float(np.sum((one.y - other.y) ** 2))
        samples += len(one.u)
        names |= {one.name, other.name}
    if not samples:
        return None
    return Repeats(tuple(r.name for r in records if r.name in names), float(np.sqrt(squares / samples)))
