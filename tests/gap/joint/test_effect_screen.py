"""The scan of periods finds one that is short, and none that rounding itself would have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, STRUCTURE, form, measured, scale

from bayes_hw.gap.joint.effect_form import TURN_STEP
from bayes_hw.gap.joint.effect_screen import screened
from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.joint_response import Effect, JointResponse, JointValues
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 700
PERIOD = 0.11


def _periods(shortest: float) -> tuple[list[float], float]:
    """Of starts of an eccentricity that promise anything, on an axis that has one of PERIOD; its travel."""
    wave = Effect(form("encoder_eccentricity"), np.array([0.004, 0.0, 2 * np.pi / PERIOD]))
    records = measured((wave,), SAMPLES, (1, 2))
    travel = max(float(np.ptp(r.y)) for r in records)
    sizes = replace(scale(SAMPLES), shortest=shortest, travel=travel)
    response = JointResponse(STRUCTURE, (), records, sizes)
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))
    starts = screened(fit, [form("encoder_eccentricity")])
    return [2 * np.pi / start.values[2] for start in starts if max(start.gains) > 30], travel


def test_a_short_period_is_found_by_the_scan() -> None:
    """Within the half cycle over the travel that a descent needs."""
    found, travel = _periods(0.0)
    assert min(abs(travel / period - travel / PERIOD) for period in found) <= TURN_STEP


def test_no_period_is_taken_that_rounding_has() -> None:
    found, _ = _periods(0.2)
    assert all(period >= 0.2 for period in found)
