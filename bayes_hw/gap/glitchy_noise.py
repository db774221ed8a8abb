"""Slow noise and glitches of the encoder at once: two stochastic effects in one likelihood.

Glitches stand out of their neighbours whatever is slow beneath them. The slow noise is fitted to the other
samples; glitches add the likelihood of their places and heights, as beside noise of the encoder alone.
"""

from __future__ import annotations

from dataclasses import replace

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit import Fit
from bayes_hw.gap.glitches import Glitches
from bayes_hw.gap.slow_noise import random_walk, wind
from bayes_hw.gap.state_noise import StateNoise
from bayes_hw.gap.stochastic import StochasticFit
from bayes_hw.gap.whitener import bridge

WITH_GLITCHES = "with glitches"


def wind_and_glitches(fit: Fit, start: FloatArray | None = None) -> StochasticFit | None:
    """Wind with glitches beside it, None without glitches; `start` as for `wind`."""
    found = Glitches.of(fit.residuals)
    if found is None:
        return None
    return _joined(wind(_bridged(fit, found), start, found.masks), fit, found)


def walk_and_glitches(fit: Fit, start: FloatArray | None = None) -> StochasticFit | None:
    """A wandering encoder with glitches, None without glitches; `start` as for `random_walk`."""
    found = Glitches.of(fit.residuals)
    return (
        None if found is None else _joined(random_walk(_bridged(fit, found), start, found.masks), fit, found)
    )


def _bridged(fit: Fit, glitches: Glitches) -> Fit:
    return replace(
        fit,
        residuals=[bridge(e[:, None], m)[:, 0] for e, m in zip(fit.residuals, glitches.masks, strict=True)],
    )


def _joined(slow: StochasticFit | None, fit: Fit, glitches: Glitches) -> StochasticFit | None:
    """`slow` noise of the other samples, and the glitches."""
    if slow is None or not isinstance(slow.whitener, StateNoise):
        return None
    total = slow.log_likelihood + glitches.log_likelihood
    return replace(
        slow,
        form=", ".join(filter(None, [slow.form, WITH_GLITCHES])),
        whitener=replace(slow.whitener, log_likelihood=total),
        log_likelihood=total,
        parameters={**slow.parameters, **glitches.parameters(fit.hypothesis.scale.units.output)},
        beside="outliers",
    )
