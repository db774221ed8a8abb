"""The scan of periods finds one that is short, and none that rounding itself would have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, STRUCTURE, form, measured, scale

from bayes_hw.gap.joint.effect_screen import screened
from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.joint_response import Effect, JointResponse, JointValues
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 700
PERIOD = 0.11


def _periods(shortest: float) -> list[float]:
    """Of starts of an eccentricity that promise anything, on an axis that has one of PERIOD."""
    wave = Effect(form("encoder_eccentricity"), np.array([0.004, 0.0, 2 * np.pi / PERIOD]))
    sizes = replace(scale(SAMPLES), shortest=shortest)
    response = JointResponse(STRUCTURE, (), measured((wave,), SAMPLES, (1, 2)), sizes)
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))
    starts = screened(fit, [form("encoder_eccentricity")])
    return [2 * np.pi / start.values[2] for start in starts if max(start.gains) > 30]


def test_a_short_period_is_found_by_the_scan() -> None:
    found = _periods(0.0)
    assert min(abs(period / PERIOD - 1) for period in found) < 0.03


def test_no_period_is_taken_that_rounding_has() -> None:
    assert all(period >= 0.2 for period in _periods(0.2))
