"""The period of a torque found again by what its torque promises through ports."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, STRUCTURE, form, measured, scale, torque

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.gap.joint.search.period_anew import periodic_by_promise, promising, with_period_anew
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 700
PERIOD = 0.015
RIPPLE = form("torque_ripple")


def rippling(period: float) -> Effect:
    planted = torque(RIPPLE, (2 * np.pi / period, 0.7), 0.002)
    assert planted.ports is not None
    looking_at_position = replace(
        Ports.none(0, 1), sections=planted.ports.sections, direct=planted.ports.direct
    )
    return replace(planted, ports=looking_at_position)


def explained_by(*effects: Effect) -> JointFit:
    """Of a record of an axis whose torque ripples with PERIOD."""
    records = measured((rippling(PERIOD),), SAMPLES, (1,))
    known = replace(scale(SAMPLES), travel=float(np.ptp(records[0].y)))
    response = JointResponse(STRUCTURE, effects, records, known)
    return JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE, effects))))


def period_of(values: np.ndarray) -> float:  # type: ignore[type-arg]
    return float(2 * np.pi / values[0])


def test_the_period_at_work_promises_most() -> None:
    starts = promising(explained_by().descended(), RIPPLE)
    assert any(period_of(np.array(start)) == pytest.approx(PERIOD, rel=0.04) for start in starts)


def test_no_period_is_shorter_than_may_be_looked_for() -> None:
    bare = explained_by()
    coarse = replace(bare.response, scale=replace(bare.response.scale, shortest=bare.response.scale.travel))
    assert promising(bare.under(coarse), RIPPLE) == []
    assert periodic_by_promise(bare.under(coarse)) == []


def test_a_torque_is_begun_at_the_periods_that_promise_most() -> None:
    """Of labels that the explanation lacks; none where it has them."""
    bare = explained_by().descended()
    found = periodic_by_promise(bare)
    best = max(found, key=lambda fit: fit.score)
    assert {label for fit in found for label in fit.labels} == {"torque_ripple"}
    assert best.score > bare.score + 20
    assert period_of(best.values.effects[-1].values) == pytest.approx(PERIOD, rel=0.02)
    assert not periodic_by_promise(explained_by(rippling(PERIOD)))


def test_a_wrong_period_is_left_for_the_right_one() -> None:
    """And a right one stays."""
    wrong = explained_by(rippling(1.3 * PERIOD)).descended()
    found = with_period_anew(wrong)
    assert period_of(found.values.effects[0].values) == pytest.approx(PERIOD, rel=0.01)
    assert found.score > wrong.score + 20
    right = explained_by(rippling(PERIOD)).descended()
    assert with_period_anew(right).score >= right.score
    assert with_period_anew(right).score < right.score + 5


def test_without_a_periodic_law_nothing_is_sought() -> None:
    plain = explained_by().descended()
    assert with_period_anew(plain) is plain
