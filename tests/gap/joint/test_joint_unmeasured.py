"""The joint search on records with samples that were not measured: nothing of them enters or is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, form, measured, scale

from bayes_hw.gap.joint.answer.corrected_model import simulate_corrected
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.residuals.remainder import remainder_of
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search.effect_screen import screened
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Record

SAMPLES = 700


def holed(record: Record, seed: int) -> Record:
    """3 % lost, in holes of one to three samples."""
    rng = np.random.default_rng(seed)
    mask = np.ones(len(record), dtype=np.bool_)
    for start in rng.choice(len(record) // 8, round(0.015 * len(record)), replace=False) * 8 + 1:
        mask[start : start + rng.integers(1, 4)] = False
    return replace(record, measured=mask)


def base_of(records: list[Record]) -> JointFit:
    response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    start = response.coordinates(JointValues(CASCADE))
    return JointFit(response, evaluate(response, start)).descended()


def test_a_fit_and_all_that_is_read_from_it_leave_holes_out() -> None:
    """The same noise as of the complete records; the screen's promises, faults of the readings and the
    remainder are finite, and no fault is seen."""
    records = measured((), SAMPLES, (1, 2))
    complete, fit = base_of(records), base_of([holed(r, i) for i, r in enumerate(records)])
    assert fit.point.samples == sum(np.count_nonzero(r.measured_samples) for r in fit.response.records)
    assert fit.point.rms == pytest.approx(complete.point.rms, rel=0.03)
    assert fit.log_likelihood / fit.point.samples == pytest.approx(
        complete.log_likelihood / complete.point.samples, rel=0.01
    )
    assert read_faults(fit).nats == {}
    left = remainder_of(fit)
    assert np.isfinite(left.coloured)
    promised = [gain for start in screened(fit, FORMS[:4]) for gain in start.gains]
    assert np.isfinite(promised).all() and max(promised) < 25


@pytest.mark.slow
def test_a_warming_gain_is_found_with_its_base_beside_holes() -> None:
    """And corrected.json simulates what the diagnosis predicts."""
    drift = Effect(form("gain_drift"), np.array([0.15, 150.0]))
    records = [holed(r, i) for i, r in enumerate(measured((drift,), SAMPLES, (1, 2, 3)))]
    found = diagnose_records(records[:2], records[2:], np.random.default_rng(1), start="rest")
    assert found.verdict.answer == ("gain_drift",)
    assert abs(found.verdict.parameters["gain_drift.change"].mean - 0.15) < 0.03
    low, high = found.verdict.base["saturation.upper"].hdi94
    assert low - 0.002 < CASCADE.upper < high + 0.002
    assert found.verdict.gap_holdout.closed > 0.8
    assert found.verdict.gap_holdout.rmse_after == pytest.approx(SIGMA, rel=0.2)
    assert found.verdict.next_experiment
    run = simulate_corrected(found.corrected, records[2].u)
    np.testing.assert_allclose(run.y, found.after, atol=1e-12)
