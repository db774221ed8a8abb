"""Explanations that base parameters are averaged over."""

from __future__ import annotations

import pytest
from joint_axis import CASCADE, STRUCTURE, form, measured, scale, torque

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.decision.joint_decision import JointDecision, explaining, rivals_of
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.readings import read_faults
from bayes_hw.gap.joint.residuals.remainder import remainder_of
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.identify.growth.descent import evaluate

SAMPLES, CONSTANTS = 400, JointCalibration.built_in()


def _fit(effects: tuple[Effect, ...]) -> JointFit:
    response = JointResponse(STRUCTURE, effects, measured((), SAMPLES, (1,)), scale(SAMPLES))
    return JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE, effects))))


def _answer(fit: JointFit, base: JointFit, ends: dict[str, JointFit]) -> JointAnswer:
    return JointAnswer(fit, base, {}, {}, read_faults(base), remainder_of(base), ends=ends)


def _decision(answer: tuple[str, ...], **probability: float) -> JointDecision:
    return JointDecision(answer, probability, ())


def test_beside_a_law_without_a_name_the_axis_has_its_share() -> None:
    base = _fit(())
    law = _fit((torque(form("other", "drag"), (), 1e-4),))
    found = _answer(law, base, {OTHER: law})
    decided = _decision((OTHER,), other=0.8)
    assert explaining(found, decided) is law
    assert rivals_of(found, decided, CONSTANTS) == [(base, CONSTANTS.unnamed_base)]


def test_beside_other_without_a_law_and_beside_a_named_effect_it_has_none() -> None:
    base = _fit(())
    rub = _fit((torque(form("friction", "Coulomb, motor"), (0.02,), 0.012),))
    assert rivals_of(_answer(base, base, {}), _decision((OTHER,), other=0.8), CONSTANTS) == []
    found = _answer(rub, base, {"friction": rub})
    assert rivals_of(found, _decision(("friction",), friction=0.99), CONSTANTS) == []
    assert rivals_of(found, _decision((OTHER,), friction=0.3), CONSTANTS) == []


def test_one_that_was_followed_to_the_end_has_as_much_as_its_odds() -> None:
    base = _fit(())
    rub, gap = (
        _fit((torque(form("friction", "Coulomb, motor"), (0.02,), weight),)) for weight in (0.012, 0.006)
    )
    found = _answer(rub, base, {"friction": rub, "torque_ripple": gap})
    decided = _decision(("friction",), friction=0.6, torque_ripple=0.2)
    ((beside, share),) = rivals_of(found, decided, CONSTANTS)
    assert beside is gap
    assert share == pytest.approx(0.25)
    none = _decision(("friction",), friction=0.99, torque_ripple=0.002)
    assert rivals_of(found, none, CONSTANTS) == []
