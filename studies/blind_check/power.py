"""The smallest gap at which an effect is named right with a stated probability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

PROBABILITY = 0.9
REACH = np.log(10.0)
"""Beyond the gaps tried, in logarithm, that the smallest gap is thought of, evenly."""

SLOPE_MEAN, SLOPE_LOG_SD = 3.0, 0.5
"""Prior of the slope: from 1 in 10 to 9 in 10 within a factor of 4.3 in the gap (1.7 to 54 at two sd)."""

THRESHOLDS, SLOPES = 400, 60


@dataclass(frozen=True)
class SmallestGap:
    """The gap over sigma where P(named right) passes PROBABILITY, with its 95 % interval.

    What lies beyond the gaps tried is given as infinity, or as zero.
    """

    gap: float
    interval: tuple[float, float]
    trials: int


def smallest_gap(gaps: Sequence[float], right: Sequence[bool], tried: tuple[float, float]) -> SmallestGap:
    """Posterior median and 95 % interval of the gap g90 in logit P = logit(0.9) + b log(g / g90), b > 0.

    The prior of log g90 is even over the range of gaps `tried` and REACH beyond, that of b log-normal; the
    posterior is summed on a grid. Gaps are over sigma.
    """
    x, y = np.log(np.asarray(gaps, dtype=np.float64)), np.asarray(right, dtype=bool)
    smallest, largest = tried
    thresholds = np.linspace(np.log(smallest) - REACH, np.log(largest) + REACH, THRESHOLDS)
    deviations = np.linspace(-3.0, 3.0, SLOPES)
    slopes = SLOPE_MEAN * np.exp(SLOPE_LOG_SD * deviations)
    log_density = np.repeat(-0.5 * deviations[None] ** 2, THRESHOLDS, axis=0)
    for log_gap, named in zip(x, y, strict=True):
        z = special.logit(PROBABILITY) + slopes * (log_gap - thresholds[:, None])
        log_density -= np.logaddexp(0.0, -z if named else z)
    density = np.exp(log_density - log_density.max()).sum(axis=1)
    below = np.cumsum(density) / density.sum()
    low, middle, high = np.exp(np.interp([0.025, 0.5, 0.975], below, thresholds))
    return SmallestGap(
        _within(float(middle), smallest, largest),
        (_within(float(low), smallest, largest), _within(float(high), smallest, largest)),
        len(x),
    )


def _within(gap: float, smallest: float, largest: float) -> float:
    """The gap where gaps were tried; beyond them only the side is known."""
    if gap < smallest:
        return 0.0
    return gap if gap <= largest else float("inf")
