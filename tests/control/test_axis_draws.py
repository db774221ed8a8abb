"""The axis by poles and residues: its response, its delay, and how a slower controller sees it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from printed.nanshan import nanshan_model
from spread_axis import delayed, spread_posterior

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.python_control import axis_systems
from bayes_hw.errors import InputError
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock

FREQUENCY = np.array([0.05, 0.4, 1.9, 2.0, 5.0, 10.0])


@pytest.mark.parametrize("free", ["conditional", "all"])
def test_response_is_that_of_the_poles_and_zeros(free: str) -> None:
    """Of the printed 26 m model, whose poles cluster at z = 1; on a grid and point by point."""
    model = nanshan_model()
    axis = AxisDraws.nominal(spread_posterior(model, free))  # type: ignore[arg-type]
    exact = model.linear.frequency_response(FREQUENCY, 20.0)
    np.testing.assert_allclose(axis.response(FREQUENCY)[0], exact, rtol=1e-9)
    np.testing.assert_allclose(axis.response_at(np.zeros(6, int), FREQUENCY), exact, rtol=1e-9)
    assert axis.velocity_gain()[0] == pytest.approx(model.linear.velocity_gain(20.0), rel=1e-9)


def test_take_keeps_the_draws_named(axis: AxisDraws) -> None:
    index = np.array([5, 3])
    np.testing.assert_array_equal(axis.take(index).response(FREQUENCY), axis.response(FREQUENCY)[index])


@pytest.mark.parametrize("delay", [0, 1, 2, 3, 5])
@pytest.mark.parametrize("ratio", [1, 2, 3])
def test_held_axis_is_the_axis_with_its_command_held(
    small_axis: HammersteinWiener, delay: int, ratio: int
) -> None:
    """Simulated at the model's rate with a command held over `ratio` samples, and at the slow rate."""
    model = delayed(small_axis, delay)
    axis = AxisDraws.nominal(spread_posterior(model))
    slow = np.random.default_rng(3).standard_normal(40)
    fast = model.linear.filter(np.repeat(slow, ratio))[::ratio]
    system = axis_systems(axis.held(ratio))[0]
    state, found = np.zeros(system.nstates), []
    for v in slow:
        found.append(float((system.C @ state)[0] + system.D[0, 0] * v))
        state = system.A @ state + system.B[:, 0] * v
    np.testing.assert_allclose(found, fast, rtol=1e-9, atol=1e-12)


def test_a_direct_term_survives_the_hold(small_axis: HammersteinWiener) -> None:
    """G with as many zeros as poles answers within the same sample."""
    zeros = np.array([0.3, 0.5, -0.2], dtype=complex)
    model = replace(small_axis, linear=LinearBlock(zeros, small_axis.linear.poles, 0.02, 1))
    axis = AxisDraws.nominal(spread_posterior(model))
    slow = np.array([1.0, -0.5, 0.25, 2.0, 0.0])
    fast = model.linear.filter(np.repeat(slow, 2))[::2]
    system = axis_systems(axis.held(2))[0]
    state, found = np.zeros(system.nstates), []
    for v in slow:
        found.append(float((system.C @ state)[0] + system.D[0, 0] * v))
        state = system.A @ state + system.B[:, 0] * v
    np.testing.assert_allclose(found, fast, rtol=1e-9, atol=1e-12)


def test_equivalent_delay_of_an_integrator_with_delay() -> None:
    """K T / (z - 1) z^-3 lags its integrator by 3.5 samples at low frequency."""
    linear = LinearBlock(np.zeros(0, complex), np.array([1.0 + 0j]), 0.01, 3)
    model = replace(nanshan_model(), linear=linear, dominant_modes=())
    axis = AxisDraws.nominal(spread_posterior(model))
    assert axis.equivalent_delay(0.5)[0] == pytest.approx(3.5 / 20, rel=1e-9)


def test_no_integrator_is_refused(small_axis: HammersteinWiener) -> None:
    poles = small_axis.linear.poles.copy()
    poles[0] = 0.97
    model = replace(small_axis, linear=replace(small_axis.linear, poles=poles))
    with pytest.raises(InputError, match="no integrator"):
        AxisDraws.nominal(spread_posterior(model))


def test_units_and_blocks_come_from_the_model(posterior: Posterior, nominal: AxisDraws) -> None:
    model = posterior.axis.model
    assert nominal.units == model.units
    assert (nominal.lower[0], nominal.upper[0]) == (model.saturation.lower, model.saturation.upper)
    assert nominal.half_width[0] == model.dead_zone.half_width


def test_a_response_asked_for_again_is_that_of_its_own_grid(axis: AxisDraws) -> None:
    """Kept by its frequencies, not by their number; nobody can change what others are given."""
    one, other = np.geomspace(0.01, 9.0, 300), np.geomspace(0.02, 8.0, 300)
    first, second, again = axis.response(one), axis.response(other), axis.response(one)
    np.testing.assert_array_equal(first, again)
    at = np.arange(axis.count)
    np.testing.assert_allclose(second[:, 7], axis.response_at(at, np.full(axis.count, other[7])), rtol=1e-9)
    with pytest.raises(ValueError, match="read-only"):
        again[0, 0] = 0.0


def test_a_pole_slower_than_every_loop_is_the_integrator(small_axis: HammersteinWiener) -> None:
    """An identified pair near z = 1 may turn the sign of the integrator's own part."""
    linear = small_axis.linear
    near = replace(linear, zeros=np.append(linear.zeros, 1 + 8e-6), poles=np.append(linear.poles, 1 - 1.3e-6))
    axis = AxisDraws.nominal(spread_posterior(replace(small_axis, linear=near)))
    plain = AxisDraws.nominal(spread_posterior(small_axis))
    assert axis.velocity_gain()[0] == pytest.approx(plain.velocity_gain()[0], rel=1e-3)
    grid = np.geomspace(1e-4 * axis.sample_rate_hz, axis.sample_rate_hz / 2, 200)
    np.testing.assert_allclose(axis.response(grid), plain.response(grid), rtol=0.03)
    slower = replace(linear, zeros=np.append(linear.zeros, 0.98), poles=np.append(linear.poles, 0.99))
    lead = AxisDraws.nominal(spread_posterior(replace(small_axis, linear=slower)))
    assert lead.velocity_gain()[0] == pytest.approx(2 * plain.velocity_gain()[0], rel=1e-6)
