"""When a residual grows or shrinks for good: change points of its energy."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import polygamma
from scipy.stats import norm

from bayes_hw.arrays import FloatArray

BLOCKS = 40
"""Parts of a record whose energies are compared."""

LEAST_BLOCKS = 4
"""Between two change points, or one and an end."""

PENALTY = 12.0
"""Least gain of half the squared deviations that makes a change point.

White and first-order noise has one in fewer than one record in thirty (tests/gap/test_change_points.py).
"""


@dataclass(frozen=True)
class ChangePoint:
    """After `time_s` of record `record` (from 0) the rms of the residual is `ratio` times that before."""

    record: int
    time_s: float
    ratio: float

    def to_dict(self) -> dict[str, float]:
        """As in verdict.json."""
        return {"record": self.record, "time_s": self.time_s, "ratio": self.ratio}


def change_points(residuals: Sequence[FloatArray], rate: float) -> tuple[ChangePoint, ...]:
    """Those of residuals (samples,), an array a record, at `rate` samples per second; in order of time.

    Logarithms of the energies of blocks are levels with normal scatter; the levels are those of least
    squared deviations and a penalty for each (optimal partitioning, doi 10.1109/LSP.2001.838216).
    """
    found = []
    for record, residual in enumerate(residuals):
        if len(residual) < 2 * BLOCKS:
            continue
        parts = np.array_split(residual, BLOCKS)
        levels, edges = _log_energies(parts), np.cumsum([len(part) for part in parts]) / rate
        starts = [0, *_partition(levels / _scatter(levels, parts)), BLOCKS]
        for before, at, after in zip(starts, starts[1:], starts[2:], strict=False):
            step = levels[at:after].mean() - levels[before:at].mean()
            found.append(ChangePoint(record, float(edges[at - 1]), float(np.exp(0.5 * step))))
    return tuple(found)


def _log_energies(parts: Sequence[FloatArray]) -> FloatArray:
    energies = np.array([np.mean(part**2) for part in parts])
    return np.asarray(np.log(np.maximum(energies, 1e-12 * max(float(energies.max()), 1e-300))))


def _scatter(levels: FloatArray, parts: Sequence[FloatArray]) -> float:
    """Standard deviation of a block's log-energy about its level: by the differences of neighbours, which
    levels hardly enter, and no less than that of white noise."""
    neighbours = float(np.median(np.abs(np.diff(levels)))) / (np.sqrt(2) * float(norm.ppf(0.75)))
    half = len(parts[-1]) / 2
    return max(neighbours, float(np.sqrt(polygamma(1, half))))


def _partition(levels: FloatArray) -> list[int]:
    """First blocks of all levels but the first, of `levels` (blocks,) in units of their scatter."""
    count = len(levels)
    sums = np.concatenate([[0.0], np.cumsum(levels)])
    squares = np.concatenate([[0.0], np.cumsum(levels**2)])
    least, previous = np.full(count + 1, np.inf), np.zeros(count + 1, dtype=np.int64)
    least[0] = -PENALTY
    for stop in range(LEAST_BLOCKS, count + 1):
        starts = np.arange(stop - LEAST_BLOCKS + 1)
        deviations = squares[stop] - squares[starts] - (sums[stop] - sums[starts]) ** 2 / (stop - starts)
        costs = least[starts] + 0.5 * deviations + PENALTY
        previous[stop] = starts[np.argmin(costs)]
        least[stop] = costs[previous[stop]]
    found: list[int] = []
    at = int(previous[count])
    while at > 0:
        found.insert(0, at)
        at = int(previous[at])
    return found
