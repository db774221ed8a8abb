"""The level from which the angles of a record count, integrated out of its likelihood.

A record that does not begin at zero counts from the mean of its first samples at rest, which is known no
better than they say: y = simulated y + level + noise. The likelihood of normal noise is quadratic in the
level, so that three of its values tell all of it, and its integral over a flat prior is exact. Every sample
is used once: those at rest are among the ones that the likelihood holds.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.model.kernel import LaggedSums


def shifted(sums: LaggedSums, samples: int, level: FloatArray) -> LaggedSums:
    """The sums of residuals less `level` (walkers,), of one record of so many samples."""
    lagged = np.empty_like(sums.lagged)
    first, last = np.zeros_like(level), np.zeros_like(level)
    for lag in range(len(lagged)):
        if lag:
            first = first + sums.head[lag - 1]
            last = last + sums.tail[len(sums.tail) - lag]
        both = 2 * sums.whole[0] - first - last
        lagged[lag] = sums.lagged[lag] - level * both + (samples - lag) * level**2
    return LaggedSums(
        lagged, sums.head - level, sums.tail - level, sums.near - level, sums.whole - samples * level
    )


def integrated(
    likelihood: Callable[[LaggedSums], FloatArray], sums: LaggedSums, samples: int, step: FloatArray
) -> FloatArray:
    """Logarithm of the integral of a record's likelihood over its level (walkers,), with a flat prior.

    `likelihood` is the logarithm of it under sums, `step` (walkers,) the level at which it is tried, of the
    size of the noise.
    """
    at_zero = likelihood(sums)
    above, below = (likelihood(shifted(sums, samples, sign * step)) for sign in (1.0, -1.0))
    curvature = np.maximum(2 * at_zero - above - below, np.finfo(float).tiny)
    return at_zero + 0.125 * (above - below) ** 2 / curvature + 0.5 * np.log(2 * np.pi * step**2 / curvature)
