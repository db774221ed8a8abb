"""Notches reach as far as they say, and the crossover allowed is the highest that keeps the share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.control.allowance import LOW_PASS_SHARE, crossover_curves, notch_ranges
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import Requirements, loop_margins

ASKED = Requirements(6.0, 45.0)


def test_notch_takes_ten_decibels_off_both_ends() -> None:
    rng = np.random.default_rng(1)
    frequency = 3.3 * np.exp(0.02 * rng.standard_normal(4000))
    damping = 0.03 * np.exp(0.1 * rng.standard_normal(4000))
    (found,) = notch_ranges([frequency], [damping], 0.95)
    assert np.mean((frequency >= found.lower_hz) & (frequency <= found.upper_hz)) == pytest.approx(
        0.95, abs=0.002
    )
    controller = Controller("c", 200.0, 1.0, notches=(found.notch,))
    size = 20 * np.log10(np.abs(controller.response(np.array([found.lower_hz, found.upper_hz]))))
    np.testing.assert_allclose(size, -10, atol=0.3)


def test_the_crossover_allowed_is_the_highest(nominal: AxisDraws, axis: AxisDraws) -> None:
    """At the gain given so many draws keep the margins; with 3 % more, fewer do."""
    for curve in crossover_curves(nominal, axis, (), ASKED, 0.9):
        controller = Controller("P", 20.0, curve.allowed_gain)
        if curve.filters != "no filter":
            controller = replace(controller, low_pass_hz=LOW_PASS_SHARE * 20)
        margins = loop_margins(Loop(axis, controller))
        assert np.mean(margins.meets(ASKED)) >= 0.9
        assert curve.allowed_hz == pytest.approx(np.median(margins.crossover_hz), rel=1e-6)
        more = replace(controller, proportional=1.03 * curve.allowed_gain)
        assert np.mean(loop_margins(Loop(axis, more)).meets(ASKED)) < 0.9


def test_what_no_gain_keeps_is_not_allowed(nominal: AxisDraws, axis: AxisDraws) -> None:
    for curve in crossover_curves(nominal, axis.take(np.arange(5)), (), Requirements(6.0, 120.0), 0.9):
        assert np.isnan(curve.allowed_hz) and not curve.share.any()


def test_notches_add_two_curves(nominal: AxisDraws, axis: AxisDraws) -> None:
    (found,) = notch_ranges([np.array([1.9, 2.1])], [np.array([0.1, 0.1])], 0.9)
    curves = crossover_curves(nominal, axis.take(np.arange(5)), [found.notch], ASKED, 0.9)
    assert [curve.filters for curve in curves][2:] == ["notches", "low pass and notches"]
