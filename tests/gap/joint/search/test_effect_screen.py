"""The scan of periods finds one that is short, and none that rounding itself would have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, SIGMA, STRUCTURE, command, form, measured, record, scale, torque

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.effect_form import JointScale
from bayes_hw.gap.joint.forms.joint_forms import COARSE_TURNS, FORMS, TURN_STEP
from bayes_hw.gap.joint.response.effect_paths import motor_angle
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search.effect_screen import Start, begins_with_periods, screened
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


def test_a_ripple_of_the_motor_is_told_from_one_of_the_load() -> None:
    """Under a resonance that swings through a good part of its period it promises more, at the same period;
    and looks at w without what swings."""
    weak, period = 1e-4, 0.06
    sections = np.array([[1.72], [0.98], [8e-3], [-7.8e-3]])
    cascade = replace(CASCADE, integrator_residue=0.01, sections=sections)
    structure = replace(STRUCTURE, integrator=True)
    ripple = form("torque_ripple", "of the motor")
    law = torque(ripple, (2 * np.pi / period, 0.4), weak, 0.0)
    law = replace(law, ports=replace(law.ports, signal=False))
    values = JointValues(cascade, (law,))
    response = JointResponse(structure, (law,), [record(np.zeros(SAMPLES), 1)], scale(SAMPLES))
    records = []
    for seed in (1, 2):
        run = response.simulate(values, command(SAMPLES, seed))
        noise = SIGMA / 10 * np.random.default_rng(seed).standard_normal(SAMPLES)
        records.append(record(run.y + noise, seed))
        np.testing.assert_allclose(run.signals[0], motor_angle(structure, values, run.v), atol=1e-9)
    travel = max(float(np.ptp(r.y)) for r in records)
    plain = JointResponse(structure, (), records, replace(scale(SAMPLES), travel=travel))
    fit = JointFit(plain, evaluate(plain, plain.coordinates(JointValues(cascade))))
    found = {name: screened(fit, [form("torque_ripple", name)]) for name in ("", "of the motor")}
    best = {name: max(starts, key=lambda s: max(s.gains)) for name, starts in found.items()}
    assert max(best["of the motor"].gains) > 2 * max(best[""].gains)
    turns = travel * best["of the motor"].values[0] / (2 * np.pi)
    assert abs(turns - travel / period) <= TURN_STEP


def test_no_period_is_taken_that_rounding_has() -> None:
    """Whether scanned or not, while longer ones are still tried."""
    shorter, _ = _starts(0.0)
    kept, _ = _starts(ROUNDED)
    assert min(map(_period, shorter)) < ROUNDED
    assert kept and min(map(_period, kept)) >= ROUNDED


def test_only_forms_that_begin_with_periods_ask_for_a_scan() -> None:
    scale = JointScale(speed=0.4, gain=0.05, travel=30.0, sigma=0.01, samples=2400, rate_hz=20.0)
    labels = {one.label for one in FORMS if begins_with_periods(one, scale)}
    assert labels == {"torque_ripple", "encoder_eccentricity"}
