"""A corrected axis in a position loop: the same motion as its open-loop simulation, and as a plain axis's."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, RATE, STRUCTURE, form, response_with, some_effect

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.simulator import simulate_loop
from bayes_hw.gap.joint.forms.effect_form import Form
from bayes_hw.gap.joint.forms.joint_forms import FORMS
from bayes_hw.gap.joint.response.effect_loop import EffectLoop
from bayes_hw.gap.joint.response.joint_values import Effect
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

SAMPLES = 400
CONTROLLER = Controller("PI", RATE, 0.8, 0.2, rate_of_change_limit=2.0)
REFERENCE = 0.3 * np.sin(np.arange(SAMPLES) / 15)


def plain_axis() -> AxisDraws:
    model = HammersteinWiener(
        "axis", RATE, Saturation(CASCADE.lower, CASCADE.upper), linear_block(STRUCTURE, CASCADE),
        DeadZone(CASCADE.half_width),
    )  # fmt: skip
    axis = AxisParameters(model, "all", output_scale=1.0)
    return AxisDraws.of_values(axis, axis.nominal[:, None])


@pytest.mark.parametrize("steps", [1, 3])
@pytest.mark.parametrize("law", FORMS, ids=lambda law: law.full_name)
def test_the_loop_moves_as_the_open_axis_does_under_its_command(law: Form, steps: int) -> None:
    """Every form: the command that the loop gave, played to the joint kernel, gives the same w and y."""
    response, values = response_with((some_effect(law),), SAMPLES)
    response = replace(response, steps=steps)
    loop = EffectLoop.of(response, response.coordinates(values)[None, :])
    axis = plain_axis()
    numbers = simulate_loop(AxisDraws(**{**axis.__dict__, "effect": loop}), CONTROLLER, REFERENCE)
    run = response.simulate(values, numbers.u[0])
    assert np.ptp(run.w) > 0.04
    np.testing.assert_allclose(numbers.w[0], run.w, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(numbers.y[0], run.y, rtol=1e-9, atol=1e-12)


def test_a_ramp_into_the_limit_is_the_same_in_the_loop() -> None:
    """A command whose ramp takes samples and meets the limit between them."""
    law = form("rate_limit", "before the limiter")
    response, values = response_with((Effect(law, np.array([5.0])),), SAMPLES)
    loop = EffectLoop.of(response, response.coordinates(values)[None, :])
    axis = plain_axis()
    numbers = simulate_loop(AxisDraws(**{**axis.__dict__, "effect": loop}), CONTROLLER, 4 * REFERENCE)
    run = response.simulate(values, numbers.u[0])
    assert np.mean(run.v == CASCADE.upper) > 0.05
    np.testing.assert_allclose(numbers.w[0], run.w, rtol=1e-9, atol=1e-12)


def test_without_effects_it_is_the_plain_loop() -> None:
    """With noise, from a start away from zero, through filters."""
    response, values = response_with((), SAMPLES)
    axis = plain_axis()
    loop = EffectLoop.of(response, response.coordinates(values)[None, :])
    noise = 0.01 * np.random.default_rng(1).standard_normal((1, SAMPLES))
    runs = [
        simulate_loop(one, CONTROLLER, REFERENCE + 0.4, noise=noise, initial_position=0.42)
        for one in (axis, AxisDraws(**{**axis.__dict__, "effect": loop}))
    ]
    for plain, other in zip(*runs, strict=True):
        np.testing.assert_allclose(other, plain, rtol=1e-9, atol=1e-12)


@pytest.mark.compiles("cascades")
def test_friction_makes_a_slow_reversal_lag() -> None:
    """More than the plain axis: the effect is really in the loop."""
    law = form("friction", "Coulomb, load")
    response, values = response_with((some_effect(law),), SAMPLES)
    loop = EffectLoop.of(response, response.coordinates(values)[None, :])
    axis = plain_axis()
    slow = 0.2 * np.abs(((np.arange(SAMPLES) / 200) % 2) - 1)
    with_it = simulate_loop(AxisDraws(**{**axis.__dict__, "effect": loop}), CONTROLLER, slow)
    without = simulate_loop(axis, CONTROLLER, slow)
    assert np.abs(with_it.y - without.y).max() > 1e-4
