"""Long records: what was found on their beginnings is fitted to all of their samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, command, measured, response_with, scale

from bayes_hw.gap.joint import joint_diagnosis
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.residuals.remainder import remainder_of
from bayes_hw.gap.joint.residuals.tone import tone_in
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.gap.joint.search.whole_records import fitted_to, on_whole_records
from bayes_hw.identify.growth.descent import evaluate

SAMPLES, SEEN = 3000, 600


def test_all_samples_move_the_fit_to_their_own_optimum() -> None:
    """As a descent from the truth on all of them ends, and away from that of the beginning."""
    whole = measured((), SAMPLES, (1,))
    begun = [whole[0].split(SEEN / SAMPLES)[0]]
    response, values = response_with((), SAMPLES)
    truth = response.coordinates(values)
    part = JointResponse(STRUCTURE, (), begun, scale(SEEN))
    seen = JointFit(part, evaluate(part, truth)).descended()
    found = fitted_to(seen, whole, None)
    all_of_it = JointResponse(STRUCTURE, (), whole, scale(SEEN))
    best = JointFit(all_of_it, evaluate(all_of_it, truth)).descended()
    assert found.point.samples == SAMPLES
    assert abs(found.log_likelihood - best.log_likelihood) < 0.1
    before = evaluate(all_of_it, seen.point.coordinates)
    assert found.log_likelihood > before.log_likelihood + 1


def test_a_line_is_taken_out_of_all_samples() -> None:
    """And its parameters are counted once."""
    (whole,) = measured((), SAMPLES, (1,))
    hum = 3 * SIGMA * np.sin(2 * np.pi * 0.43 * whole.t + 0.7)
    whole = replace(whole, y=whole.y + hum)
    begun = [whole.split(SEEN / SAMPLES)[0]]
    response, values = response_with((), SAMPLES)
    part = JointResponse(STRUCTURE, (), begun, scale(SEEN))
    seen = JointFit(part, evaluate(part, response.coordinates(values))).descended()
    tone = tone_in(seen)
    assert tone is not None
    base = tone.without
    answer = JointAnswer(base, base, {}, {}, read_faults(base), remainder_of(base), tone=tone)
    found = on_whole_records(answer, [whole])
    assert found.tone is not None and found.fit.taken == base.taken == 3
    assert abs(found.tone.frequency_hz - 0.43) < 1e-3
    assert found.fit.point.samples == SAMPLES
    assert abs(found.fit.point.rms / SIGMA - 1) < 0.05


@pytest.mark.slow
def test_glitches_beyond_the_beginning_are_weighted_away(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the answer, its notes and its numbers are of all samples."""
    monkeypatch.setattr(joint_diagnosis, "MOST_SAMPLES", SEEN)
    whole, held_out = measured((), SAMPLES, (1, 2))
    rng = np.random.default_rng(0)
    glitches = rng.choice(SAMPLES - 40, 40, replace=False) + 20
    whole.y[glitches] += rng.choice([-1.0, 1.0], len(glitches)) * 0.05
    found = diagnose_records([whole], [held_out], rng)
    assert found.verdict.answer == ("outliers",)
    assert "every number was then fitted to all" in " ".join(found.verdict.notes)
    assert f"{SEEN} of {SAMPLES}" in " ".join(found.verdict.notes)
    assert len(found.train[0]) == SAMPLES
    weights = found.found.fit.response.weights
    assert weights is not None and np.all(weights[0][glitches] > 100)
    lower = found.verdict.base["saturation.lower"]
    assert abs(lower.mean - CASCADE.lower) < 5 * lower.sd
    assert len(command(SAMPLES, 1)) == len(found.found.base.point.residuals[0])
