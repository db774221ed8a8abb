"""Limit cycles: predicted where the gain is too high, and simulated with the same frequency and size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.limit_cycles import check_cycles, predict_cycles, simulate_cycles
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import loop_margins


def critical_gain(axis: AxisDraws) -> float:
    """Proportional gain at which half of the draws are unstable."""
    margins = loop_margins(Loop(axis, Controller("P", 20.0, 1.0, low_pass_hz=3.0)))
    return float(np.median(10 ** (margins.gain_margin_db / 20)))


@pytest.fixture(scope="module")
def few(axis: AxisDraws) -> AxisDraws:
    return axis.take(np.arange(40))


@pytest.mark.compiles
def test_below_the_critical_gain_there_is_none(few: AxisDraws) -> None:
    controller = Controller("P", 20.0, 0.5 * critical_gain(few), low_pass_hz=3.0)
    for check in check_cycles(Loop(few, controller), 40):
        assert not check.predicted.has_cycle.any()
        assert not check.simulated.sustained.any()
        assert np.isnan(check.simulated.frequency_hz).all()
        assert check.agreement == 1


def test_above_it_both_find_the_same(few: AxisDraws) -> None:
    """Away from zero: within 2 % in frequency and 4 % in amplitude for every draw."""
    controller = Controller("PI", 20.0, 1.5 * critical_gain(few), 0.1, low_pass_hz=3.0)
    check = check_cycles(Loop(few, controller), 40)[0]
    assert check.place == "away from zero"
    assert check.predicted.has_cycle.all() and check.simulated.sustained.all()
    stays = check.predicted.stable
    np.testing.assert_array_equal(check.predicted.draw[stays], np.arange(40))
    np.testing.assert_allclose(check.predicted.frequency_hz[stays], check.simulated.frequency_hz, rtol=0.02)
    np.testing.assert_allclose(
        check.predicted.position_amplitude[stays], check.simulated.position_amplitude, rtol=0.04
    )


def test_between_draws_it_is_the_unstable_ones(few: AxisDraws) -> None:
    """At the critical gain the probability is that of being unstable, in prediction and simulation."""
    loop = Loop(few, Controller("P", 20.0, critical_gain(few), low_pass_hz=3.0))
    unstable = loop.spectral_radius() > 1
    np.testing.assert_array_equal(predict_cycles(loop, "away from zero").has_cycle, unstable)
    check = check_cycles(loop, 40)[0]
    assert check.agreement >= 0.9


def test_a_wide_dead_zone_holds_the_oscillation_around_zero(few: AxisDraws) -> None:
    """An oscillation smaller than the dead zone cannot be seen by the controller; away from zero it is."""
    controller = Controller("P", 20.0, 1.5 * critical_gain(few), low_pass_hz=3.0)
    swing = predict_cycles(Loop(few, controller), "away from zero").position_amplitude.max()
    wide = replace(few, half_width=np.full(few.count, 3 * swing))
    assert not predict_cycles(Loop(wide, controller), "around zero").has_cycle.any()
    assert predict_cycles(Loop(wide, controller), "away from zero").has_cycle.all()
    assert not simulate_cycles(wide, controller, "around zero").sustained.any()


def test_a_narrow_dead_zone_has_a_threshold_below_the_cycle(few: AxisDraws) -> None:
    """Two balances around zero: an unstable small one, that an oscillation must exceed, and a stable one."""
    controller = Controller("P", 20.0, 1.5 * critical_gain(few), low_pass_hz=3.0)
    away = predict_cycles(Loop(few, controller), "away from zero")
    narrow = replace(few, half_width=np.full(few.count, 0.02 * away.position_amplitude.min()))
    found = predict_cycles(Loop(narrow, controller), "around zero")
    assert found.has_cycle.all()
    for draw in range(few.count):
        mine = found.draw == draw
        small = found.position_amplitude[mine & ~found.stable]
        assert len(small) == 1 and small[0] < found.position_amplitude[mine & found.stable][0]


def test_the_controllers_own_limit_bounds_the_oscillation(few: AxisDraws) -> None:
    controller = Controller("P", 20.0, 1.5 * critical_gain(few), low_pass_hz=3.0)
    wide = predict_cycles(Loop(few, controller), "away from zero").position_amplitude
    tight = replace(controller, speed_limit=(-0.1, 0.125))
    narrow = predict_cycles(Loop(few, tight), "away from zero").position_amplitude
    scale = (0.1 / -few.lower + 0.125 / few.upper) / 2
    np.testing.assert_allclose(narrow, wide * scale, rtol=0.01)
