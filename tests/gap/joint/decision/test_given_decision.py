"""What is left beyond the stated noise is said to be something else; what a label removes stays said."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from joint_axis import GIVEN_SAMPLES, SIGMA, measured, model

from bayes_hw.gap.joint.decision.given_decision import GivenCalibration, GivenEvidence, decide_given
from bayes_hw.gap.joint.decision.joint_decision import JointDecision
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.residuals.remainder import remainder_of
from bayes_hw.gap.joint.search.joint_search import JointAnswer


def answer_of(records: list, fitted: list, nats: dict[str, float]) -> JointAnswer:  # type: ignore[type-arg]
    """The base on `records`, and on `fitted` as though the effects of `nats` had changed them so."""
    base, fit = best_base(records, model()), best_base(fitted, model())
    return JointAnswer(fit, base, nats, {}, read_faults(base), remainder_of(fit))


def decided(found: JointAnswer, noise: float) -> JointDecision:
    return decide_given(GivenEvidence.of(found, noise))


def disturbed(size: float) -> list:  # type: ignore[type-arg]
    """White errors of several times the noise beside it."""
    plain = measured((), GIVEN_SAMPLES, (1, 2))
    rng = np.random.default_rng(5)
    return [replace(r, y=r.y + size * SIGMA * rng.standard_normal(GIVEN_SAMPLES)) for r in plain]


def test_noise_as_stated_is_nothing_and_more_is_something() -> None:
    quiet, loud = measured((), GIVEN_SAMPLES, (1, 2)), disturbed(3.0)
    assert decided(answer_of(quiet, quiet, {}), SIGMA).answer == ()
    said = decided(answer_of(loud, loud, {}), SIGMA)
    assert said.answer == ("other",)
    assert said.probability["none"] < 0.15
    assert decided(answer_of(loud, loud, {}), float("nan")).answer == ()


def test_a_label_that_removes_most_of_the_error_stays() -> None:
    louder, loud = disturbed(9.0), disturbed(2.0)
    kept = decided(answer_of(louder, loud, {"friction": 300.0}), SIGMA)
    assert kept.answer == ("friction", "other")
    lost = decided(answer_of(loud, loud, {"friction": 300.0}), SIGMA)
    assert lost.answer == ("other",)
    assert lost.probability["friction"] <= 0.3


def test_less_is_too_much_where_it_is_coloured() -> None:
    """A third more than the stated noise may be noise stated too small, unless it follows itself."""
    louder, loud = disturbed(9.0), disturbed(0.9)
    evidence = GivenEvidence.of(answer_of(louder, loud, {"friction": 300.0}), SIGMA)
    assert evidence.left == pytest.approx(1.35 * SIGMA, rel=0.07)
    assert decide_given(evidence).answer == ("friction",)
    left = replace(evidence.joint.remainder, order=8, coloured=200.0)
    said = decide_given(replace(evidence, joint=replace(evidence.joint, remainder=left)))
    assert said.answer == ("friction", "other")


def test_two_labels_that_outweigh_what_is_left_stay_both() -> None:
    """One that explains less than what is left makes room for what has no name."""
    louder, loud = disturbed(9.0), disturbed(0.9)
    evidence = GivenEvidence.of(answer_of(louder, loud, {"friction": 600.0, "gain_drift": 300.0}), SIGMA)

    def answer(coloured: float) -> tuple[str, ...]:
        left = replace(evidence.joint.remainder, order=8, coloured=coloured)
        return decide_given(replace(evidence, joint=replace(evidence.joint, remainder=left))).answer

    assert answer(200.0) == ("friction", "gain_drift")
    assert answer(400.0) == ("friction", "other")


def test_no_gap_is_stated_as_surely_as_it_came_true() -> None:
    quiet = measured((), GIVEN_SAMPLES, (1, 2))
    found = answer_of(quiet, quiet, {})
    found.rivals.update({"transport_delay": -14.0, "unmodelled_mode": -17.0})
    assert decided(found, SIGMA).probability["none"] > 0.95
    found.rivals["friction"] = -1.0
    assert decided(found, SIGMA).probability["none"] < 0.85


def test_two_labels_hardly_told_apart_share_by_nats() -> None:
    quiet = measured((), GIVEN_SAMPLES, (1, 2))
    found = answer_of(quiet, quiet, {"wind": 120.0})
    evidence = GivenEvidence.of(found, SIGMA)
    calibration = GivenCalibration.built_in()
    between = calibration.nats_between_causes
    alone = replace(evidence.joint, labels=("wind",), own=120.0, rivals={"wind": 120.0})
    before = decide_given(replace(evidence, joint=alone)).probability
    for lead in (0.0, between):
        joint = replace(alone, rivals={"wind": 120.0, "sensor_drift": 120.0 - lead})
        said = decide_given(replace(evidence, joint=joint)).probability
        assert said["wind"] / said["sensor_drift"] == pytest.approx(np.exp(lead / between), rel=1e-6)
        together = before["wind"] + before["sensor_drift"]
        assert said["wind"] + said["sensor_drift"] == pytest.approx(together)


def test_evidence_in_a_file_is_decided_the_same() -> None:
    louder, loud = disturbed(9.0), disturbed(2.0)
    for noise in (SIGMA, float("nan")):
        evidence = GivenEvidence.of(answer_of(louder, loud, {"friction": 300.0}), noise)
        again = GivenEvidence.from_dict(json.loads(json.dumps(evidence.to_dict(), allow_nan=False)))
        assert decide_given(again) == decide_given(evidence)


def test_what_the_model_cannot_simulate_goes_through_a_file_too() -> None:
    plain = measured((), GIVEN_SAMPLES, (1, 2))
    found = GivenEvidence.of(answer_of(disturbed(9.0), plain, {"friction": 300.0}), SIGMA)
    endless = replace(found, before=float("inf"))
    again = GivenEvidence.from_dict(json.loads(json.dumps(endless.to_dict(), allow_nan=False)))
    assert decide_given(again) == decide_given(endless)
