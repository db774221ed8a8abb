"""Ripple led from the measured position to the simulated one: minima that a plain fit does not reach."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis
from fitted import AXIS, noisy, simulated_with
from own_simulators import motor

from bayes_hw.gap.effects.catalogue import TransportDelay
from bayes_hw.gap.effects.drive import LoadRipple, TorqueRipple
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.continuation import can_be_led, led, measured_positions
from bayes_hw.gap.fit.fit import evaluated, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.fit.joint_fits import joined
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.simulate.simulator_chain import SimulatorBuilder

INPUTS = [command(700, 1), command(700, 2)]
PLAIN = Plain(SIGMA)
BASE = hypothesis(AXIS, INPUTS)


@pytest.mark.compiles("chains")
@pytest.mark.parametrize("torque, period", [(1.5, 0.06), (2.0, 0.06)])
def test_a_minimum_is_found_that_a_plain_fit_misses(torque: float, period: float) -> None:
    """Both from the same start, the period that a scan at the measured positions finds."""
    truth = (torque, 0.5 * torque, period)
    measured = noisy(simulated_with(LoadRipple(), truth, INPUTS))
    base = fit(BASE, measured, BASE.prior_means, PLAIN)
    positions = measured_positions(base)
    screen = Screen(base, PLAIN.widened(base.rmse), positions)
    found, start = joined(base, screen.candidates(LoadRipple(), finely=True)[:1])
    followed = led(found, start, positions, measured, PLAIN)
    at_truth = found.to_coordinates(np.array([*BASE.builder.axis.nominal, *truth]))
    best = fit(found, measured, at_truth, PLAIN)
    assert fit(found, measured, start, PLAIN).cost > 3 * best.cost
    assert followed.cost < 1.2 * best.cost
    assert followed.values[-3:] == pytest.approx(truth, rel=0.1)
    assert followed.hypothesis is found and found.known is None


def test_measured_positions_are_nearer_than_simulated_ones() -> None:
    """The model has 3 per cent less gain than the axis; w lies the dead zone beyond what is shown."""
    clean = BASE.simulate_signals(BASE.builder.axis.nominal)
    measured = noisy([y for _, y in clean])
    off = BASE.builder.axis.nominal.copy()
    off[3] *= 0.97
    held = evaluated(BASE, measured, BASE.to_coordinates(off), PLAIN)
    simulated, dead_zone = BASE.motion(off)
    for w, seen, (true, shown) in zip(simulated, measured_positions(held), clean, strict=True):
        moving = np.abs(true) > 2 * dead_zone
        assert np.std((seen - true)[moving]) < 0.7 * SIGMA
        assert np.std((w - true)[moving]) > SIGMA
        assert np.abs(true - shown)[moving] == pytest.approx(dead_zone)


@pytest.mark.parametrize("effect, ripples", [(LoadRipple(), True), (TransportDelay(), False)])
def test_ripple_of_a_drive_train_can_be_led(effect: Effect, ripples: bool) -> None:
    assert can_be_led(BASE.with_effect(effect)) is ripples


def test_a_simulator_of_the_users_cannot() -> None:
    base = Hypothesis(SimulatorBuilder(motor()), BASE.scale, INPUTS)
    assert not can_be_led(base.with_effect(TorqueRipple()))
