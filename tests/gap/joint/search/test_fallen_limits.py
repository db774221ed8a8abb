"""Limits that fall at an instant of every record are found with their instants, and none where they stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, command, record, response_with, scale

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.readings import Readings
from bayes_hw.gap.joint.residuals.remainder import remainder_of
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.fallen_limits import fallen_limits
from bayes_hw.gap.joint.search.joint_search import JointAnswer, _beside_fallen_limits, silent
from bayes_hw.identify.growth.descent import evaluate

SAMPLES, LEFT = 700, 0.9
INSTANTS = (210, 450)
INTEGRATING = replace(CASCADE, integrator_residue=0.1)
STRUCTURE_TOO = replace(STRUCTURE, integrator=True)


def _fitted(left: float) -> JointFit:
    """The axis fitted to two records in which its limits fall to `left` of theirs."""
    response = replace(response_with((), SAMPLES)[0], structure=STRUCTURE_TOO)
    values, records = JointValues(INTEGRATING), []
    for seed, instant in enumerate(INSTANTS, start=1):
        u, noise = command(SAMPLES, seed), SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)
        low = np.clip(u, left * CASCADE.lower, left * CASCADE.upper)
        given = np.where(np.arange(SAMPLES) < instant, u, low)
        records.append(record(response.simulate(values, given).y + noise, seed))
    found = JointResponse(STRUCTURE_TOO, (), records, scale(SAMPLES))
    return JointFit(found, evaluate(found, found.coordinates(values))).descended()


def test_the_fall_and_its_instants_are_found_and_are_the_answer_where_nothing_explains_more() -> None:
    fit = _fitted(LEFT)
    answer = JointAnswer(fit, fit, {}, {"friction": 40.0}, Readings((), {}, None, {}), remainder_of(fit))
    beside = _beside_fallen_limits(answer, silent)
    found = beside.fallen
    assert found is not None
    assert found.left == pytest.approx(LEFT, abs=0.01)
    np.testing.assert_allclose(found.instants, INSTANTS, atol=21)
    assert found.without.point.rms == pytest.approx(SIGMA, rel=0.1)
    assert found.without.taken == len(INSTANTS) + 1
    assert found.nats > 100
    assert fallen_limits(fit, 1e6) is None
    assert beside.fit is beside.ends[OTHER]
    assert beside.nats == {OTHER: found.nats}
    assert beside.rivals == {"friction": 40.0, OTHER: found.nats}


def test_limits_that_stay_have_no_fall() -> None:
    assert fallen_limits(_fitted(1.0), 25.0) is None
