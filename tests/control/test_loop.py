"""The loop: its poles against python-control's, its grid, and what it refuses."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from spread_axis import delayed, spread_posterior

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.loop import Loop, frequency_grid
from bayes_hw.control.notch import Notch
from bayes_hw.control.python_control import loop_systems
from bayes_hw.errors import InputError
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock

CONTROLLERS = (
    Controller("PI", 20.0, 1.2, 0.3),
    Controller("PID", 20.0, 1.2, 0.3, 0.2, 0.1, low_pass_hz=4.0, notches=(Notch(2.0, 0.1, 0.4),)),
    Controller("slow", 5.0, 0.6, 0.1, delay_samples=1),
    Controller("P", 10.0, 1.0),
)


@pytest.mark.parametrize("controller", CONTROLLERS, ids=lambda c: c.name)
def test_poles_and_response_are_those_of_python_control(axis: AxisDraws, controller: Controller) -> None:
    loop = Loop(axis.take(np.arange(4)), controller)
    frequency = np.array([0.05, 0.7, 2.0])
    z = np.exp(2j * np.pi * frequency / controller.sample_rate_hz)
    found = loop.response(frequency)
    for system, radius, response in zip(loop_systems(loop), loop.spectral_radius(), found, strict=True):
        np.testing.assert_allclose(system(z), response, rtol=1e-9)
        assert np.abs(control.feedback(system).poles()).max() == pytest.approx(radius, rel=1e-9)


def test_a_factor_on_the_loop_is_a_factor_on_the_gains(axis: AxisDraws, controller: Controller) -> None:
    doubled = replace(controller, proportional=2 * controller.proportional, integral=2 * controller.integral)
    np.testing.assert_allclose(
        Loop(axis, controller).spectral_radius(2.0), Loop(axis, doubled).spectral_radius(), rtol=1e-9
    )


def test_a_loop_without_any_delay_is_refused(small_axis: HammersteinWiener) -> None:
    zeros = np.array([0.3, 0.5, -0.2], dtype=complex)
    direct = replace(small_axis, linear=LinearBlock(zeros, small_axis.linear.poles, 0.02, 0))
    axis = AxisDraws.nominal(spread_posterior(direct))
    with pytest.raises(InputError, match="delay_samples"):
        Loop(axis, Controller("c", 20.0, 1.0))
    Loop(axis, Controller("c", 20.0, 1.0, delay_samples=1))
    Loop(AxisDraws.nominal(spread_posterior(delayed(small_axis, 0))), Controller("c", 20.0, 1.0))


def test_the_grid_is_dense_where_the_draws_resonate(axis: AxisDraws) -> None:
    """At least ten points in the half-power width of every draw's resonance, and up to half the rate."""
    grid = frequency_grid(axis, 20.0)
    assert grid[-1] == pytest.approx(10.0)
    s = np.log(axis.pair_poles[0]) * 20.0
    frequency, width = np.abs(s) / (2 * np.pi), -s.real / np.pi
    points = [np.count_nonzero(np.abs(grid - f) < w / 2) for f, w in zip(frequency, width, strict=True)]
    assert min(points) >= 10
