"""Limit cycles: predicted where the gain is too high, and simulated with the same frequency and size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.limit_cycles import (
    balancing_bias,
    check_cycles,
    dead_zone_gain,
    predict_cycles,
    saturation_gain,
    saturation_mean,
    simulate_cycles,
)
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import loop_margins


def critical_gain(axis: AxisDraws) -> float:
    """Proportional gain at which half of the draws are unstable."""
    margins = loop_margins(Loop(axis, Controller("P", 20.0, 1.0, low_pass_hz=3.0)))
    return float(np.median(10 ** (margins.gain_margin_db / 20)))


@pytest.fixture(scope="module")
def few(axis: AxisDraws) -> AxisDraws:
    return axis.take(np.arange(40))


@pytest.mark.compiles("cascades")
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


ANGLE = (np.arange(200_000) + 0.5) * 2 * np.pi / 200_000
AMPLITUDE = np.array([0.1, 0.4, 0.9, 3.0, 40.0])


def first_harmonic(output: np.ndarray) -> float:
    return float(2 * np.mean(output * np.sin(ANGLE)))


@pytest.mark.parametrize("bias", [-0.5, 0.0, 0.3, 2.0])
def test_saturation(bias: float) -> None:
    for amplitude in AMPLITUDE:
        output = np.clip(bias + amplitude * np.sin(ANGLE), -0.3, 0.5)
        gain = saturation_gain(np.array(amplitude), np.array(-0.3), np.array(0.5), bias)
        mean = saturation_mean(np.array(amplitude), np.array(-0.3), np.array(0.5), bias)
        assert gain == pytest.approx(first_harmonic(output) / amplitude, abs=1e-6)
        assert mean == pytest.approx(np.mean(output), abs=1e-6)


def test_balancing_bias_leaves_no_mean() -> None:
    """Also with limits as unequal as 1 to 3, for any amplitude; none is needed below both limits."""
    lower, upper = np.array(-0.2), np.array(0.6)
    bias = balancing_bias(AMPLITUDE, lower, upper)
    np.testing.assert_allclose(saturation_mean(AMPLITUDE, lower, upper, bias), 0, atol=1e-9)
    assert bias[0] == pytest.approx(0, abs=1e-9)
    assert bias[-1] < -0.1


def test_dead_zone() -> None:
    for amplitude in AMPLITUDE:
        w = amplitude * np.sin(ANGLE)
        output = np.maximum(w - 0.35, 0) + np.minimum(w + 0.35, 0)
        gain = dead_zone_gain(np.array(amplitude), np.array(0.35))
        assert gain == pytest.approx(first_harmonic(output) / amplitude, abs=1e-6)
    assert dead_zone_gain(np.array(0.0), np.array(0.1)) == 0
    assert dead_zone_gain(np.array(0.2), np.array(0.0)) == 1
