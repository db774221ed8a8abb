"""The observer form: derivatives, the filter written out, holes and doubtful readings, chaotic motion."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from joint_axis import (
    CASCADE,
    SIGMA,
    STRUCTURE,
    assert_tangents,
    command,
    form,
    record,
    response_with,
    scale,
    some_effect,
    torque,
)

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.answer.corrected_model import corrected_model, predict_corrected, simulate_corrected
from bayes_hw.gap.joint.answer.free_function import Seen
from bayes_hw.gap.joint.answer.joint_notes import of_followed
from bayes_hw.gap.joint.decision.joint_decision import JointDecision, explaining
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.posterior.joint_closure import spread
from bayes_hw.gap.joint.posterior.joint_posterior import JointPosterior
from bayes_hw.gap.joint.residuals.readings import Readings, read_faults
from bayes_hw.gap.joint.residuals.remainder import remainder_of
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues, Ports
from bayes_hw.gap.joint.search.joint_search import JointAnswer, silent
from bayes_hw.gap.joint.search.known_input import forms_of
from bayes_hw.gap.joint.search.observer import (
    OBSERVER,
    errors_ahead,
    follows_a_cycle,
    kalman_gain,
    observed,
    unobserved,
)
from bayes_hw.gap.joint.search.verification import verified
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 300
GAIN = np.array([0.4, -0.2])


def _observer(gain: FloatArray = GAIN) -> Effect:
    ports = Ports(
        np.zeros(0), gain[:, None].copy(), np.array([0.05, 0.4]), np.zeros(0), np.zeros((2, 1))
    )  # fmt: skip
    return Effect(OBSERVER, np.empty(0), ports)


def _noisy(response: JointResponse, values: JointValues) -> JointResponse:
    """With readings of the axis under other noise, a hole and doubtful samples among them."""
    rng = np.random.default_rng(5)
    first = response.records[0]
    seen = np.ones(len(first), dtype=np.bool_)
    seen[36:44] = False
    y = response.simulate(values, first.u, first.known).y + 0.2 * SIGMA * rng.standard_normal(len(first))
    weights = np.ones(len(first))
    weights[155:175] = 4.0
    return replace(response, records=[replace(first, y=y, measured=seen)], weights=(weights,))


@pytest.mark.parametrize("steps", [1, 3])
@pytest.mark.parametrize("law", FORMS, ids=lambda law: law.full_name)
def test_tangents_are_the_derivatives(law: Form, steps: int) -> None:
    """Also through what the readings correct."""
    effects = (_observer(), some_effect(law))
    response, values = response_with(effects, SAMPLES)
    response = replace(_noisy(response, values), steps=steps)
    assert_tangents(response, values, law.full_name)


def test_tangents_of_what_a_known_input_adds_to_the_readings() -> None:
    reading = Effect(forms_of("sun")[1], np.array([0.03, 1.5]))
    response, values = response_with((_observer(), reading), SAMPLES)
    sun = np.cumsum(np.random.default_rng(1).standard_normal(SAMPLES)) * 0.05
    response = replace(response, records=[replace(response.records[0], known={"sun": sun})])
    assert_tangents(_noisy(response, values), values, "reading")


def test_residuals_are_those_of_the_filter_written_out() -> None:
    """Of an axis without a dead zone."""
    cascade = replace(CASCADE, half_width=0.0)
    structure = replace(STRUCTURE, dead_zone=False, lower=False, upper=False)
    cascade = replace(cascade, lower=-np.inf, upper=np.inf)
    values = JointValues(cascade, (_observer(),))
    y = np.cumsum(np.random.default_rng(2).standard_normal(SAMPLES)) * 0.01
    response = JointResponse(structure, values.effects, [record(y, 1)], scale(SAMPLES))
    a1, a2, b1, b2 = cascade.sections[:, 0]
    transition = np.array([[a1, 1.0, 0, 0], [-a2, 0, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 0.4]])
    entering, gain = np.array([b1, b2, 0.005, 0.0]), np.array([*GAIN, 0.0, 0.05])
    shown = np.array([1.0, 0.0, 1.0, 1.0])
    state, expected = np.zeros(4), []
    u = np.concatenate([[0.0], command(SAMPLES, 1)])[:SAMPLES]
    for v, reading in zip(u, y, strict=True):
        e = reading - shown @ state
        expected.append(e)
        state = transition @ state + entering * v + gain * e
    x = response.coordinates(values)
    np.testing.assert_allclose(response.residuals(x)[0], expected, atol=1e-12)
    often = replace(response, steps=4)
    np.testing.assert_allclose(often.residuals(x)[0], expected, atol=1e-9)


def test_holes_and_the_dead_zone_correct_nothing() -> None:
    response, values = response_with((_observer(),), SAMPLES)
    noisy = _noisy(response, values)
    run = noisy.along(values, 0)
    assert not run.torques[0, 36:44].any()
    assert not run.torques[0, run.slope == 0].any()
    shown = noisy.records[0].y - run.y
    outside = np.clip((np.abs(run.w) - CASCADE.half_width) / SIGMA, 0, 1)
    np.testing.assert_allclose(run.torques[0, 155:175], (outside * shown / 16)[155:175])
    assert np.ptp(outside[155:175]) > 0
    np.testing.assert_allclose(run.torques[0, 175:], (outside * shown)[175:])


def test_no_reading_corrects_a_simulation() -> None:
    """What is predicted, stored and looped is the axis without its observer."""
    effects = (_observer(), torque(form("backlash", "dynamic"), (1e-4,), 2e-4))
    response, values = response_with(effects, SAMPLES)
    noisy = _noisy(response, values)
    plain = replace(noisy, template=effects[1:])
    u = command(SAMPLES, 3)
    simulated = plain.simulate(JointValues(CASCADE, effects[1:]), u).y
    np.testing.assert_allclose(noisy.simulate(values, u).y, simulated, atol=1e-12)
    fit = JointFit(noisy, evaluate(noisy, noisy.coordinates(values)))
    assert fit.labels == ("backlash",)
    free, kept = unobserved(fit)
    assert free.observer is None
    np.testing.assert_allclose(free.point.coordinates, fit.point.coordinates[kept])
    np.testing.assert_allclose(free.response.simulate(free.values, u).y, simulated, atol=1e-12)
    posterior = JointPosterior(fit, np.tile(fit.point.coordinates, (3, 1)), {}, {}, {}, ())
    stored = json.loads(json.dumps(corrected_model("axis", noisy.records, posterior, SIGMA)))
    assert [effect["label"] for effect in stored["effects"]] == ["backlash"]
    np.testing.assert_allclose(simulate_corrected(stored, u).y, simulated, atol=1e-12)
    _, low, high = predict_corrected(stored, u)
    np.testing.assert_allclose((high + low) / 2, simulated, atol=1e-12)


def test_the_first_gain_is_that_of_the_settled_filter() -> None:
    """Found by running the filter's equations until they settle."""
    torques, sigma = np.array([[2e-3], [-1e-3]]), 0.002
    gain = kalman_gain(CASCADE, torques, sigma)
    assert gain is not None
    a = np.array([[1.5, 1.0], [-0.9, 0.0]])
    spread = torques @ torques.T
    spread = spread + 1e-6 * np.trace(spread) * np.eye(2)
    variance = np.zeros((2, 2))
    for _ in range(2000):
        k = a @ variance[:, 0] / (variance[0, 0] + sigma**2)
        variance = a @ variance @ a.T - np.outer(k, variance[0] @ a.T) + spread
    np.testing.assert_allclose(gain, k, rtol=1e-6)


def test_without_a_law_there_is_nothing_to_observe() -> None:
    response, values = response_with((), SAMPLES)
    assert observed(JointFit(response, evaluate(response, response.coordinates(values)))) == []


SLOW = replace(CASCADE, sections=np.array([[1.97 * np.cos(0.3)], [0.97], [1e-3], [-8e-4]]))
"""A resonance of 21 samples, which passes a gap slowly."""


def _bouncing(gap: float, weight: float) -> Effect:
    """A gap of a spring about which the load of the slow axis bounces."""
    ports = Ports(
        np.zeros(0), np.array([[weight], [0.738 * weight]]), np.array([0.0, 0.5]), np.zeros(0),
        np.zeros((2, 1)),
    )  # fmt: skip
    return Effect(form("backlash", "dynamic"), np.array([gap]), ports)


def test_chaotic_motion_is_fitted_where_no_simulation_follows_it() -> None:
    """A command that differs by 1e-4 ends many deviations apart: from a gap a tenth too wide the fit of a
    simulation gets nowhere; the observer leaves the noise and finds the gap."""
    sigma, samples, gap = 5e-5, 1500, 6.272e-5
    response, _ = response_with((_bouncing(gap, 1.0964e-4),), samples)
    values, u = JointValues(SLOW, response.template), command(samples, 1)
    y = response.simulate(values, u).y
    apart = response.simulate(values, (1 + 1e-4) * u).y - y
    assert np.sqrt(np.mean(apart**2)) > 10 * sigma
    measured = record(y + sigma * np.random.default_rng(3).standard_normal(samples), 1)
    begun = (_bouncing(1.1 * gap, 1.12e-4),)
    response = replace(
        response, template=begun, records=[measured], scale=replace(response.scale, sigma=sigma)
    )
    point = evaluate(response, response.coordinates(JointValues(SLOW, begun)))
    simulated = JointFit(response, point)
    free, found = simulated.descended(), observed(simulated)[0].descended()
    assert free.innovation_sigma > 3 * sigma
    assert found.innovation_sigma < 1.1 * sigma
    np.testing.assert_allclose(found.values.effects[1].values, gap, rtol=0.05)
    (note,) = of_followed(found)
    off, left = spread(unobserved(found)[0]), spread(found)
    assert off > 3 * sigma
    assert f"off by {off:.2g} deg" in note
    assert note.endswith(f"leaves {left:.2g}")
    assert of_followed(simulated) == []
    bare = simulated.without("backlash")
    assert off >= spread(free)
    assert follows_a_cycle(found)
    assert sigma**2 < errors_ahead(found, 21) < 0.5 * errors_ahead(bare, 21)
    idle = _weaker(found)
    assert not follows_a_cycle(idle)
    assert spread(unobserved(idle)[0]) >= spread(free)
    answers = [
        JointAnswer(fit, base, {}, {}, read_faults(fit), remainder_of(fit))
        for fit, base in ((found, bare), (found, free), (simulated, found), (idle, free))
    ]
    assert [a.follows_no_better for a in answers] == [False, False, False, True]
    none = JointDecision(("other",), {}, ())
    assert explaining(answers[-1], none) is free


def _weaker(fit: JointFit) -> JointFit:
    """The fit with a gap whose torque does nearly nothing, under the same corrections."""
    observer, gap = fit.values.effects
    assert gap.ports is not None
    ports = replace(gap.ports, sections=1e-6 * gap.ports.sections, direct=1e-6 * gap.ports.direct)
    values = JointValues(fit.values.cascade, (observer, replace(gap, ports=ports)))
    return fit.moved(fit.structure, values, fit.point.whitener)


def test_an_observer_does_not_stay_without_a_label() -> None:
    """Nor does a gap of an axis that has none."""
    effects = (_observer(), _bouncing(1e-4, 1e-5))
    response, values = response_with(effects, SAMPLES)
    rng = np.random.default_rng(7)
    y = response.simulate(JointValues(CASCADE), command(SAMPLES, 1)).y + SIGMA * rng.standard_normal(SAMPLES)
    response = replace(response, records=[record(y, 1)])
    fit = JointFit(response, evaluate(response, response.coordinates(values)))
    base = fit.without("backlash").without_observer().descended()
    none = Readings((), {}, None, {})
    kept, nats = verified(fit, base, [], none, silent)
    assert kept is base
    assert nats == {}


def _with_observer(level: float) -> JointFit:
    """A ripple in observer form on a record that counts from a level so far off."""
    effect = some_effect(form("torque_ripple"))
    response, values = response_with((_observer(), effect), SAMPLES)
    plain = JointValues(values.cascade, (effect,))
    without = replace(response, template=(effect,))
    first = response.records[0]
    noise = SIGMA * np.random.default_rng(3).standard_normal(SAMPLES)
    y = without.simulate(plain, first.u, first.known).y + noise + level
    response = replace(response, records=[replace(first, y=y, level_sd=SIGMA)])
    return JointFit(response, evaluate(response, response.coordinates(values)))


def test_a_view_shows_the_effect_and_not_the_observer() -> None:
    fit = _with_observer(0.0)
    assert Seen(fit, Readings((), {}, None, {})).number("torque_ripple") == 1
    assert fit.response.template[1].form.label == "torque_ripple"


def test_levels_are_those_of_the_simulation() -> None:
    """Corrected by its readings the motion follows them, whatever they count from."""
    fit = _with_observer(10 * SIGMA)
    assert fit.levels[0] == pytest.approx(10 * SIGMA, abs=SIGMA)
