"""Numbers of an answer with their intervals: of the base model, of its effects, of the readings."""

from __future__ import annotations

from collections.abc import Sequence

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.verdict import NOISE_SIGMA, Estimate
from bayes_hw.gap.joint.posterior.joint_posterior import JointPosterior
from bayes_hw.gap.joint.residuals.readings import Readings
from bayes_hw.units import Units

LOG_SD_OF_READINGS = 0.1
"""Of what the readings themselves tell: a step, a share, a spread."""


def base_estimates(
    posterior: JointPosterior, sigma: float, relative_error: float, units: Units
) -> dict[str, Estimate]:
    """Of the base model, with the noise of the encoder and how far that may be off."""
    found = {
        name: Estimate.of(draws, posterior.units.get(name, "")) for name, draws in posterior.base.items()
    }
    found[NOISE_SIGMA] = Estimate.log_normal(sigma, relative_error, units.output)
    return found


def effect_estimates(
    posterior: JointPosterior, answer: Sequence[str], readings: Readings, units: Units
) -> dict[str, Estimate]:
    """Of the effects and the errors of the readings that the answer names."""
    named = set(answer) - {OTHER}
    found = {
        name: Estimate.of(draws, posterior.units.get(name, ""))
        for name, draws in posterior.effects.items()
        if name.split(".")[0] in named
    }
    for key, value in readings.parameters.items():
        label, quantity = key.split(".")
        if label in named:
            unit = {"step": units.output, "size": units.output, "sd": "s"}.get(quantity, "")
            found[key] = Estimate.log_normal(value, LOG_SD_OF_READINGS, unit)
    return found
