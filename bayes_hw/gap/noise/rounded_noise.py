"""Slow noise of records that an encoder rounds: two stochastic effects in one likelihood.

A rounding error of a moving axis is white and uniform over a step (Widrow and Kollar, Quantization Noise,
2008), of variance step^2 / 12, which is what the likelihood of slow noise takes it for.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.slow_noise import random_walk, wind
from bayes_hw.gap.noise.stochastic import ROUNDING, StochasticFit, lattice_step, rounding_step
from bayes_hw.gap.noise.whitener import only_read

WITH_ROUNDING = "with rounding"


def wind_and_rounding(fit: Misfit, start: FloatArray | None = None) -> StochasticFit | None:
    """Wind in rounded records, None where they lie on no lattice; `start` as for `wind`."""
    return _with_rounding(wind, fit, start)


def walk_and_rounding(fit: Misfit, start: FloatArray | None = None) -> StochasticFit | None:
    """A wandering encoder that rounds, None where the records lie on no lattice."""
    return _with_rounding(random_walk, fit, start)


def _with_rounding(
    kind: Callable[..., StochasticFit | None], fit: Misfit, start: FloatArray | None
) -> StochasticFit | None:
    step = lattice_step(only_read(fit.measured, fit.unread))
    if step == 0:
        return None
    slow = kind(fit, start, [np.full(len(e), step**2 / 12) for e in fit.residuals])
    if slow is None:
        return None
    return slow.with_second(ROUNDING, WITH_ROUNDING, rounding_step(step, fit.scale.units.output))
