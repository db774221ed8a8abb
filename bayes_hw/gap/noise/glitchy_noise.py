"""Slow noise and glitches of the encoder at once: two stochastic effects in one likelihood.

Glitches stand out of their neighbours whatever is slow beneath them. The slow noise is fitted to the other
samples; glitches add the likelihood of their places and heights, as beside noise of the encoder alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.glitches import Glitches
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.slow_noise import random_walk, wind
from bayes_hw.gap.noise.state_noise import StateNoise
from bayes_hw.gap.noise.stochastic import StochasticFit
from bayes_hw.gap.noise.whitener import bridged_records

WITH_GLITCHES = "with glitches"


def wind_and_glitches(fit: Misfit, start: FloatArray | None = None) -> StochasticFit | None:
    """Wind with glitches beside it, None without glitches; `start` as for `wind`."""
    return _with_glitches(wind, fit, start)


def walk_and_glitches(fit: Misfit, start: FloatArray | None = None) -> StochasticFit | None:
    """A wandering encoder with glitches, None without glitches; `start` as for `random_walk`."""
    return _with_glitches(random_walk, fit, start)


def _with_glitches(
    kind: Callable[..., StochasticFit | None], fit: Misfit, start: FloatArray | None
) -> StochasticFit | None:
    """Slow noise of a kind, fitted to the samples that are no glitches, and the glitches."""
    glitches = Glitches.of(fit.residuals)
    if glitches is None:
        return None
    bridged = fit.with_residuals(bridged_records(fit.residuals, glitches.masks))
    slow = kind(bridged, start, [np.where(mask, np.inf, 0.0) for mask in glitches.masks])
    if slow is None or not isinstance(slow.whitener, StateNoise):
        return None
    total = slow.log_likelihood + glitches.log_likelihood
    both = replace(slow, whitener=replace(slow.whitener, log_likelihood=total), log_likelihood=total)
    unit = fit.scale.units.output
    return both.with_second("outliers", WITH_GLITCHES, glitches.parameters(unit))
