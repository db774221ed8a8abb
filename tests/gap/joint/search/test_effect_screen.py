"""The scan of periods finds one that is short, and none that rounding itself would have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, STRUCTURE, form, measured, scale

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.effect_form import COARSE_TURNS, TURN_STEP
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search.effect_screen import Start, screened
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 700
PERIOD = 0.011
ROUNDED = 0.02


def _starts(shortest: float) -> tuple[list[Start], float]:
    """Starts of an eccentricity on an axis that has one of PERIOD; its travel."""
    wave = Effect(form("encoder_eccentricity"), np.array([0.002, 0.0, 2 * np.pi / PERIOD]))
    records = measured((wave,), SAMPLES, (1, 2))
    travel = max(float(np.ptp(r.y)) for r in records)
    sizes = replace(scale(SAMPLES), shortest=shortest, travel=travel)
    response = JointResponse(STRUCTURE, (), records, sizes)
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))
    return screened(fit, [form("encoder_eccentricity")]), travel


def _period(start: Start) -> float:
    return float(2 * np.pi / start.values[2])


def test_a_short_period_is_found_by_the_scan() -> None:
    """Shorter than any that is started from without a scan; within the step that a descent needs."""
    starts, travel = _starts(0.0)
    found = [_period(start) for start in starts if max(start.gains) > 30]
    assert travel / PERIOD > COARSE_TURNS
    assert min(abs(travel / period - travel / PERIOD) for period in found) <= TURN_STEP


def test_no_period_is_taken_that_rounding_has() -> None:
    """Whether scanned or not, while longer ones are still tried."""
    shorter, _ = _starts(0.0)
    kept, _ = _starts(ROUNDED)
    assert min(map(_period, shorter)) < ROUNDED
    assert kept and min(map(_period, kept)) >= ROUNDED
