"""Constants that are fitted to cases state what came true in such cases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from blind_check.joint_calibrate import (
    GivenCase,
    JointCase,
    calibrate_jointly,
    left_out_scores,
    log_deviations,
)

from bayes_hw.gap.joint.decision.given_decision import GivenCalibration, GivenEvidence, decide_given
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.decision.joint_decision import JointEvidence, decide
from bayes_hw.gap.joint.residuals.remainder import Remainder

QUIET = Remainder(0, 0.0)


def _case(nats: dict[str, float], effects: tuple[str, ...]) -> JointCase:
    evidence = JointEvidence(nats, {}, {}, sum(nats.values()), tuple(nats), QUIET)
    return JointCase(evidence, effects)


def test_false_answers_make_answers_less_sure() -> None:
    """Of twenty answers on many nats four are wrong, and of five without any effect none is."""
    named = [_case({"friction": 800.0}, ("friction",) if i % 5 else ("backlash",)) for i in range(20)]
    cases = named + [_case({}, ()) for _ in range(5)]
    by_hand = JointCalibration.built_in()
    fitted = calibrate_jointly(cases, by_hand)
    sure = decide(named[0].evidence, fitted).probability["friction"]
    assert abs(sure - 0.8) < 0.1 < 1 - by_hand.floor - 0.8
    assert decide(cases[-1].evidence, fitted).probability["none"] > 0.92
    assert sum(c.score(fitted) for c in cases) > sum(c.score(by_hand) for c in cases)
    assert left_out_scores(cases, by_hand, 2).mean() > np.mean([c.score(by_hand) for c in cases])


def _given(nats: dict[str, float], effects: tuple[str, ...]) -> GivenCase:
    """The same around a model, as much noise left as it states."""
    joint = _case(nats, effects).evidence
    rivals = nats or {"transport_delay": -14.0}
    return GivenCase(GivenEvidence(replace(joint, rivals=rivals), 1.0, 1.0 + bool(nats), 1.0), effects)


@pytest.mark.slow
def test_around_a_model_more_cases_tell_a_constant_better() -> None:
    """Pairs are wrong half the time; nulls always right. Neither is stated surer than that."""
    pair = {"friction": 400.0, "transport_delay": 300.0}
    truths = (("friction", "transport_delay"), ("backlash", "transport_delay"))
    by_hand = GivenCalibration.built_in()
    spread = []
    for count in (4, 24):
        cases = [_given(pair, truths[i % 2]) for i in range(count)] + [_given({}, ())] * count
        fitted = calibrate_jointly(cases, by_hand)
        spread.append(log_deviations(cases, fitted, by_hand))
    assert decide_given(cases[-1].evidence, fitted).probability["none"] > 0.97
    assert 0.5 < decide_given(cases[0].evidence, fitted).probability["friction"] < 0.85
    assert spread[1]["pair_floor"] < 0.6 * spread[0]["pair_floor"]
    assert all(0 < x < 1.3 for x in spread[1].values())
