"""The joint kernel against differences, the plain cascade and effects written out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, STRUCTURE, assert_tangents, command, form, response_with, some_effect, torque

from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.response.joint_values import Effect
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

SAMPLES = 400


@pytest.mark.parametrize("law", FORMS, ids=lambda law: law.full_name)
def test_tangents_are_the_derivatives(law: Form) -> None:
    """Of all but the few samples where a limit, a play or a clip begins to act."""
    effect = some_effect(law)
    response, values = response_with((effect,), SAMPLES)
    assert_tangents(response, values, law.full_name)


TOGETHER = (
    ("friction", "presliding, motor"),
    ("torque_ripple", ""),
    ("other", "slip beyond the spring"),
    ("other", "torque limit"),
)


@pytest.mark.parametrize("count", [2, 3, 4])
@pytest.mark.parametrize("steps", [1, 4])
def test_tangents_of_several_laws_together_are_the_derivatives(count: int, steps: int) -> None:
    """Each acts on the signals of the others."""
    effects = tuple(some_effect(form(*name)) for name in TOGETHER[:count])
    response, values = response_with(effects, SAMPLES)
    assert_tangents(replace(response, steps=steps), values, f"{count} laws in {steps} steps")


@pytest.mark.parametrize("law", FORMS, ids=lambda law: law.full_name)
def test_coordinates_and_values_are_inverse(law: Form) -> None:
    response, values = response_with((some_effect(law),), SAMPLES)
    x = response.coordinates(values)
    np.testing.assert_allclose(response.coordinates(response.values(x)), x, rtol=1e-12)


def test_without_effects_it_is_the_cascade() -> None:
    response, values = response_with((), SAMPLES)
    model = HammersteinWiener(
        "axis", 20.0, Saturation(CASCADE.lower, CASCADE.upper), linear_block(STRUCTURE, CASCADE),
        DeadZone(CASCADE.half_width),
    )  # fmt: skip
    u = command(SAMPLES, 1)
    np.testing.assert_allclose(response.simulate(values, u).y, model.simulate(u).y, atol=1e-10)


def test_gain_drift_and_bias_by_their_formulas() -> None:
    u = command(SAMPLES, 1)
    drift = Effect(form("gain_drift"), np.array([0.2, 50.0]))
    bias = Effect(form("command_bias"), np.array([0.01]))
    response, values = response_with((drift, bias), SAMPLES)
    delayed = np.clip(np.concatenate([[0.0], u[:-1]]), CASCADE.lower, CASCADE.upper)
    expected = delayed * (1 + 0.2 * (1 - np.exp(-np.arange(SAMPLES) / 50.0))) + 0.01
    np.testing.assert_allclose(response.simulate(values, u).v, expected, atol=1e-14)


def test_a_ramp_is_the_mean_over_each_sample() -> None:
    """Fine steps of the same ramp, averaged over each sample."""
    u = command(SAMPLES, 1)
    rate = 0.07
    response, values = response_with((Effect(form("rate_limit"), np.array([1 / rate])),), SAMPLES)
    target = np.clip(np.concatenate([[0.0], u[:-1]]), CASCADE.lower, CASCADE.upper)
    fine, at, expected = 2000, 0.0, []
    reach = rate * np.arange(1, fine + 1) / fine
    for value in target:
        path = at + np.clip(value - at, -reach, reach)
        expected.append(path.mean())
        at = path[-1]
    np.testing.assert_allclose(response.simulate(values, u).v, expected, atol=1e-4)


def test_a_ramp_before_the_limiter_is_limited_on_its_way() -> None:
    """Fine steps of the same ramp, limited and averaged over each sample."""
    u = command(SAMPLES, 1)
    rate = 0.07
    early = Effect(form("rate_limit", "before the limiter"), np.array([1 / rate]))
    response, values = response_with((early,), SAMPLES)
    target = np.concatenate([[0.0], u[:-1]])
    fine, at, expected = 2000, 0.0, []
    reach = rate * (np.arange(fine) + 0.5) / fine
    for value in target:
        path = at + np.clip(value - at, -reach, reach)
        expected.append(np.clip(path, CASCADE.lower, CASCADE.upper).mean())
        at += np.clip(value - at, -rate, rate)
    assert np.ptp(target) > CASCADE.upper - CASCADE.lower
    np.testing.assert_allclose(response.simulate(values, u).v, expected, atol=1e-4)


@pytest.mark.parametrize("name", ["in steps", "in steps, before the limiter"])
@pytest.mark.parametrize("steps", [1, 4])
def test_a_controller_moves_its_ramp_at_once_and_holds_it(name: str, steps: int) -> None:
    """One step of the controller a sample, whatever else acts within the sample."""
    u = command(SAMPLES, 1)
    rate = 0.07
    held = Effect(form("rate_limit", name), np.array([1 / rate, 1.0]))
    response, values = response_with((held,), SAMPLES)
    target = np.concatenate([[0.0], u[:-1]])
    limits = CASCADE.lower, CASCADE.upper
    at, expected = 0.0, []
    for value in target if "before" in name else np.clip(target, *limits):
        at += np.clip(value - at, -rate, rate)
        expected.append(at)
    within = replace(response, steps=steps)
    np.testing.assert_allclose(within.simulate(values, u).v, np.clip(expected, *limits), atol=1e-12)


def test_play_and_asymmetry_by_their_formulas() -> None:
    u = command(SAMPLES, 1)
    effects = (
        Effect(form("backlash", "kinematic"), np.array([0.03])),
        Effect(form("gain_asymmetry"), np.array([np.log(1.1)])),
    )
    response, values = response_with(effects, SAMPLES)
    run = response.simulate(values, u)
    out, expected = 0.0, []
    for w in run.w:
        out = min(max(out, w - 0.03), w + 0.03)
        expected.append(1.1 * max(out - 0.02, 0.0) + min(out + 0.02, 0.0))
    np.testing.assert_allclose(run.y, expected, atol=1e-12)


@pytest.mark.parametrize(("name", "order"), [("torque limit", 2), ("hysteresis of the spring", 3)])
def test_the_twist_is_what_the_axis_would_do_left_alone(name: str, order: int) -> None:
    """Differences of the motion to come, where no command and no torque drives it any more."""
    effect = torque(form("other", name), (1e3,), 0.0, 0.0)
    response, values = response_with((effect,), SAMPLES)
    u = command(SAMPLES, 1)
    u[200:] = 0.0
    run = response.simulate(values, u)
    begin = 200 + STRUCTURE.delay_samples
    coming = np.diff(run.w, order)
    assert np.ptp(coming[begin:]) > 1e-4
    np.testing.assert_allclose(run.signals[0, begin : len(coming)], coming[begin:], atol=1e-12)


def test_what_slips_follows_the_twist_beyond_what_grips() -> None:
    """Like play: nothing until the grip is passed, and what slipped stays."""
    grip = 1e-4
    response, values = response_with(
        (torque(form("other", "slip beyond the spring"), (grip,), 1e-6, 0.0),), SAMPLES
    )
    run = response.simulate(values, command(SAMPLES, 1))
    slipped, expected = 0.0, []
    for twist in run.signals[0]:
        slipped = min(max(slipped, twist - grip), twist + grip)
        expected.append(slipped / grip)
    assert np.mean(np.diff(expected) == 0) > 0.3
    assert np.ptp(expected) > 1.0
    np.testing.assert_allclose(run.torques[0], expected, atol=1e-12)


def test_no_hole_hides_a_motion_that_overflows() -> None:
    """The squares of its errors are not finite, though the encoder was silent where it left the axis, and
    though a motion that is no number lies neither above the dead zone nor below."""
    stiffening = torque(form("cubic_stiffness"), (1.0,), 1e3, 1.0)
    response, values = response_with((stiffening,), SAMPLES)
    w = response.simulate(values, response.records[0].u).w
    left = int(np.flatnonzero(~np.isfinite(w) | (np.abs(w) > 1.0))[0])
    assert np.isnan(w[-1])
    assert 0 < left < SAMPLES - 10
    measured = np.arange(SAMPLES) < left
    silent = replace(response, records=[replace(response.records[0], measured=measured)])
    (residual,) = silent.residuals(silent.coordinates(values))
    assert np.isinf(residual[measured]).all()
    assert np.isnan(residual[~measured]).all()
