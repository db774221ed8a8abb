"""The loop in the time domain: against the model's own simulation, linear theory, and its limits."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from spread_axis import delayed, spread_posterior

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.loop import Loop
from bayes_hw.control.notch import Notch
from bayes_hw.control.python_control import loop_systems
from bayes_hw.control.simulator import simulate_loop
from bayes_hw.model.blocks import GainNormalization
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

REFERENCE = np.where(np.arange(400) > 3, 1.0, 0.0)
PI = Controller("PI", 20.0, 2.0, 0.5)


def unlimited(axis: AxisDraws) -> AxisDraws:
    wide = np.full(axis.count, 1e9)
    return replace(axis, lower=-wide, upper=wide, half_width=0 * wide)


@pytest.mark.parametrize("ratio", [1, 4])
@pytest.mark.parametrize("delay", [0, 2])
def test_the_axis_in_the_loop_is_the_model(small_axis: HammersteinWiener, delay: int, ratio: int) -> None:
    """The command that the loop made, given to the model's own simulator, gives the same w and y."""
    model = delayed(small_axis, delay)
    axis = AxisDraws.nominal(spread_posterior(model))
    signals = simulate_loop(axis, replace(PI, sample_rate_hz=20.0 / ratio), REFERENCE)
    alone = model.simulate(signals.u[0])
    np.testing.assert_allclose(signals.w[0], alone.w, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(signals.y[0], alone.y, rtol=1e-9, atol=1e-12)
    assert np.ptp(signals.u) > model.saturation.upper


def test_gains_of_the_static_blocks_act_as_in_the_model(small_axis: HammersteinWiener) -> None:
    """c1, c2 and c3 of their own: the same outputs as the model's, and the linear loop has their product."""
    model = small_axis.normalized(GainNormalization(2.0, 0.7, 0.9))
    axis = AxisDraws.nominal(spread_posterior(model))
    for sign in (1, -1):
        signals = simulate_loop(axis, PI, sign * REFERENCE)
        np.testing.assert_allclose(signals.y[0], model.simulate(signals.u[0]).y, rtol=1e-9, atol=1e-12)
    plain = Loop(AxisDraws.nominal(spread_posterior(small_axis)), PI)
    np.testing.assert_allclose(Loop(axis, PI).spectral_radius(), plain.spectral_radius(1.8), rtol=1e-9)


@pytest.mark.parametrize(
    "controller",
    [
        PI,
        replace(
            PI, derivative=0.3, derivative_filter_s=0.1, notches=(Notch(2.0, 0.1, 0.4),), low_pass_hz=5.0
        ),
        replace(PI, delay_samples=2),
    ],
)
def test_without_limits_it_is_the_linear_loop(axis: AxisDraws, controller: Controller) -> None:
    """Step response of T = L / (1 + L) by python-control."""
    few = unlimited(axis.take(np.arange(3)))
    found = simulate_loop(few, controller, REFERENCE).y
    for system, y in zip(loop_systems(Loop(few, controller)), found, strict=True):
        closed = control.feedback(system)
        expected = control.forced_response(closed, inputs=REFERENCE).outputs
        np.testing.assert_allclose(y, expected, rtol=1e-7, atol=1e-9)


def test_limits_of_the_controller_hold(axis: AxisDraws) -> None:
    limited = replace(PI, speed_limit=(-0.2, 0.3), rate_of_change_limit=0.5)
    u = simulate_loop(axis, limited, 5 * REFERENCE).u
    assert u.max() == pytest.approx(0.3) and u.min() >= -0.2
    assert np.abs(np.diff(u, axis=1)).max() <= 0.5 / 20 + 1e-12


def test_anti_windup_takes_the_overshoot_of_the_integral_away(axis: AxisDraws) -> None:
    """A long step at full speed: remembering the unlimited command overshoots far more."""
    strong = replace(PI, integral=1.0, speed_limit=(-0.3, 0.3))
    reference = np.where(np.arange(2000) > 3, 4.0, 0.0)
    overshoot = {
        time: float(
            np.mean(simulate_loop(axis, replace(strong, anti_windup_s=time), reference).y.max(axis=1) - 4)
        )
        for time in (0.0, 1.0, np.inf)
    }
    assert overshoot[0.0] < 0.5 * overshoot[np.inf]
    assert overshoot[1.0] < 0.5 * overshoot[np.inf]


def test_nothing_moves_before_the_reference_does(axis: AxisDraws) -> None:
    """Started away from zero, with filters, on the reference."""
    controller = replace(PI, notches=(Notch(2.0, 0.1, 0.4),), low_pass_hz=5.0)
    start = 3.0 + axis.half_width
    signals = simulate_loop(axis, controller, np.full(200, 3.0), initial_position=start)
    np.testing.assert_allclose(signals.y, 3.0, rtol=1e-12)
    np.testing.assert_allclose(signals.u, 0.0, atol=1e-12)


def test_noise_is_what_the_controller_sees(axis: AxisDraws) -> None:
    """Noise on the measurement moves the axis as a reference of the opposite sign does."""
    noise = np.random.default_rng(1).standard_normal((axis.count, 200))
    few, still = unlimited(axis), np.zeros(200)
    found = simulate_loop(few, PI, still, noise=noise).y
    for draw in range(3):
        one = few.take(np.array([draw]))
        expected = simulate_loop(one, replace(PI, integral=PI.integral), -noise[draw]).y[0]
        np.testing.assert_allclose(found[draw, 1:] - found[draw, 0], found[draw, 1:], atol=1e-12)
        difference = np.abs(found[draw] - expected)
        assert difference.max() < np.abs(PI.proportional * noise[draw, 0]) + 1e-9
