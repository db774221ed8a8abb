"""A bend in a spring is the same motion from either side, and has the name of what bends so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, command, form, record, response_with, torque

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.gap.joint.search.bent_spring import as_it_bends, from_other_side, opposes
from bayes_hw.gap.joint.search.observer import OBSERVER
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 600
BEND = 1e-4
LIMIT, GAP = form("other", "torque limit"), form("backlash", "dynamic")


def bent(law: Form, weight: float) -> Effect:
    """Of a spring that bends within the motion; the torque enters and is seen by the mode."""
    effect = torque(law, (BEND,), weight, 0.2)
    assert effect.ports is not None
    return replace(effect, ports=replace(effect.ports, direct=np.array([0.1 * weight, 0.3])))


def fit_to(effects: tuple[Effect, ...], noise: FloatArray | float = 0.0, steps: int = 1) -> JointFit:
    """At its own values, on a record of them."""
    response, values = response_with(effects, SAMPLES)
    response = replace(response, steps=steps)
    y = response.simulate(values, command(SAMPLES, 1)).y + noise
    response = replace(response, records=[record(y, 1)])
    return JointFit(response, evaluate(response, response.coordinates(values)))


@pytest.mark.parametrize("law", [LIMIT, GAP], ids=["beyond", "within"])
@pytest.mark.parametrize(("weight", "steps"), [(1e-5, 1), (-1e-5, 1), (1e-5, 4)])
def test_either_side_is_the_same_motion(law: Form, weight: float, steps: int) -> None:
    """With an observer beside it, whose gains enter through the poles of the other side."""
    gain = Ports(np.zeros(0), np.array([[0.1], [-0.05]]), np.array([0.0, 0.5]), np.zeros(0), np.zeros((2, 1)))
    fit = fit_to((Effect(OBSERVER, np.empty(0), gain), bent(law, weight)), steps=steps)
    other = from_other_side(fit, 1)
    assert other is not None
    assert {fit.labels, other.labels} == {("other",), ("backlash",)}
    assert other.structure.order == fit.structure.order + 1
    runs = [one.response.along(one.values, 0) for one in (fit, other)]
    bare = fit.response.along(JointValues(CASCADE, fit.values.effects[:1]), 0)
    apart = np.abs(runs[0].w - bare.w).max()
    np.testing.assert_allclose(runs[1].w, runs[0].w, atol=1e-8 * apart)
    np.testing.assert_allclose(
        runs[1].signals[1], runs[0].signals[1], atol=1e-8 * np.abs(runs[0].signals).max()
    )
    assert np.abs(runs[0].signals[1]).max() > 1.5 * BEND


def test_a_bend_is_a_gap_where_the_axis_is_stiffer_beyond() -> None:
    """And gives way where it is softer, from whichever side it was found."""
    noise = SIGMA * np.random.default_rng(2).standard_normal(SAMPLES)
    for law in (LIMIT, GAP):
        signs = {}
        for weight in (1e-5, -1e-5):
            fit = fit_to((bent(law, weight),), noise)
            found = as_it_bends(fit)
            stiffer = opposes(fit, 0) == (law is LIMIT)
            assert found.labels == (("backlash",) if stiffer else ("other",))
            assert (found is fit) == (fit.labels == found.labels)
            signs[weight] = stiffer
        assert signs[1e-5] != signs[-1e-5]
