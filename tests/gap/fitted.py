"""Hypotheses held against residuals made for the purpose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from drive_axis import SIGMA, command, drive_axis, hypothesis, white

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.explanation import Explanation
from bayes_hw.gap.fit import Fit, evaluated
from bayes_hw.gap.hypothesis import Hypothesis
from bayes_hw.gap.stochastic import autoregression
from bayes_hw.gap.whitener import Plain

AXIS = drive_axis()
SAMPLES = 1200


def base(samples: int = SAMPLES, records: int = 2) -> Hypothesis:
    """The axis without effects on `records` commands."""
    return hypothesis(AXIS, [command(samples, seed) for seed in range(records)])


def with_residuals(residuals: list[FloatArray], found: Hypothesis | None = None) -> Fit:
    """The axis at its own parameters, its records off by `residuals`."""
    found = found or base(len(residuals[0]), len(residuals))
    simulated = found.simulate(found.builder.axis.nominal)
    measured = [s + e for s, e in zip(simulated, residuals, strict=True)]
    return of_records(measured, found)


def of_records(measured: list[FloatArray], found: Hypothesis) -> Fit:
    """The axis at its own parameters held against `measured`."""
    start = found.to_coordinates(found.builder.axis.nominal)
    return evaluated(found, measured, start, Plain(SIGMA))


def explained(residuals: list[FloatArray]) -> Explanation:
    """The same with first-order noise fitted to the residuals."""
    fit = with_residuals(residuals)
    coloured = replace(fit, whitener=autoregression(fit))
    return Explanation(coloured, None, coloured.log_evidence())


def noisy(clean: Sequence[FloatArray]) -> list[FloatArray]:
    """Records (samples,) with white noise, each its own."""
    return [y + white(len(y), SIGMA, 7 + i) for i, y in enumerate(clean)]


def simulated_with(effect: Effect, values: tuple[float, ...], inputs: list[FloatArray]) -> list[FloatArray]:
    """Noise-free outputs of the axis with an effect."""
    found = hypothesis(AXIS, inputs, effect)
    return found.simulate(np.concatenate([found.builder.axis.nominal, values]))
