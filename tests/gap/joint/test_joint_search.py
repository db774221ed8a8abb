"""A planted effect is found from records alone, and none where there is none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, form, measured, scale, torque

from bayes_hw.errors import InputError
from bayes_hw.gap.joint.corrected_model import simulate_corrected
from bayes_hw.gap.joint.effect_form import FORMS
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.joint_moves import effect_candidates
from bayes_hw.gap.joint.joint_response import JointResponse
from bayes_hw.gap.joint.joint_search import search
from bayes_hw.gap.joint.joint_values import Effect, JointValues
from bayes_hw.gap.joint.slow_noise import WALK, WIND
from bayes_hw.identify.growth.descent import evaluate

SAMPLES, LONG = 700, 2000


def test_nothing_is_found_where_nothing_is() -> None:
    found = search(measured((), SAMPLES, (1, 2)))
    assert found.fit.labels == ()
    assert found.readings.nats == {}


def test_a_warming_gain_is_found_with_its_base() -> None:
    """And corrected.json simulates what the diagnosis predicts."""
    drift = Effect(form("gain_drift"), np.array([0.15, 150.0]))
    records = measured((drift,), SAMPLES, (1, 2, 3))
    found = diagnose_records(records[:2], records[2:], np.random.default_rng(1))
    assert found.verdict.answer == ("gain_drift",)
    assert abs(found.verdict.parameters["gain_drift.change"].mean - 0.15) < 0.03
    low, high = found.verdict.base["saturation.upper"].hdi94
    assert low - 0.002 < CASCADE.upper < high + 0.002
    assert found.verdict.gap_holdout.closed > 0.8
    assert found.verdict.next_experiment
    run = simulate_corrected(found.corrected, records[2].u)
    np.testing.assert_allclose(run.y, found.after, atol=1e-12)


def test_a_walk_beside_a_warming_gain_is_a_cause_of_the_noise() -> None:
    """Found in the search, kept when it is verified, held against wind; what is left has no colour, and the
    base holds although the angle wanders by many deviations of the noise."""
    drift = Effect(form("gain_drift"), np.array([0.2, 150.0]))
    rng = np.random.default_rng(8)
    records = [
        replace(r, y=r.y + np.cumsum(0.15 * SIGMA * rng.standard_normal(LONG)))
        for r in measured((drift,), LONG, (1, 2, 3))
    ]
    found = diagnose_records(records[:2], records[2:], np.random.default_rng(1))
    answer = found.found
    assert set(answer.fit.labels) == {WALK, "gain_drift"} == set(answer.nats)
    assert answer.nats[WALK] > 25
    assert answer.remainder.order == 1 and answer.remainder.coloured == 0
    assert {WALK, WIND} <= set(answer.followed)
    assert answer.rivals[WALK] >= answer.rivals[WIND]
    assert set(found.verdict.answer) == {WALK, "gain_drift"}
    assert found.verdict.base["noise.sigma"].mean == pytest.approx(SIGMA, rel=0.2)
    low, high = found.verdict.base["saturation.upper"].hdi94
    assert low < CASCADE.upper < high


def test_friction_is_found_without_a_drive_train() -> None:
    """Of every label, at the base that has none."""
    rub = torque(form("friction", "Coulomb, motor"), (0.02,), 0.012)
    response = JointResponse(STRUCTURE, (), measured((rub,), SAMPLES, (1, 2)), scale(SAMPLES))
    base = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE)))).descended()
    found = max(effect_candidates(base, FORMS), key=lambda fit: fit.score)
    assert found.labels == ("friction",)
    assert found.score > base.score + 50


def test_no_records_are_refused() -> None:
    with pytest.raises(InputError, match="no record"):
        diagnose_records([], [], np.random.default_rng(1))
