"""Figures of axis and loops name what they show, with units, and stand where there is little to show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from spread_axis import spread_posterior

from bayes_hw.control.controller import Controller
from bayes_hw.control.design import Design, DesignSettings, design
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock
from bayes_hw.report.design.figures_control_axis import axis_response, crossover_allowance
from bayes_hw.report.design.figures_control_loop import (
    limit_cycle_check,
    margin_distributions,
    nyquist_and_sensitivities,
)
from bayes_hw.report.design.figures_control_time import time_responses, uncertainty_sets
from bayes_hw.report.page.document import Figure

Labels = Callable[[Callable[[], Figure]], list[str]]


@pytest.fixture(scope="module")
def found(small_axis: HammersteinWiener) -> Design:
    """An axis without any mode, and a controller that is unstable on every draw."""
    linear = LinearBlock(np.array([0.3 + 0j]), np.array([1.0, 0.7], dtype=complex), 0.02, 2)
    bare = replace(small_axis, linear=linear, dominant_modes=())
    settings = DesignSettings(110, 20, 20, tuned=())
    controllers = [Controller("hot", 20.0, 60.0, low_pass_hz=3.0), Controller("calm", 20.0, 1.0)]
    return design(spread_posterior(bare), controllers, np.random.default_rng(1), settings=settings)


def test_margins_of_an_unstable_loop_are_none(found: Design, labels_of: Labels) -> None:
    text = labels_of(lambda: margin_distributions(found.loops, found.settings.requirements))
    assert text.count("none") == 4
    assert {"gain margin (dB)", "phase margin (deg)", "delay margin (s)", "bandwidth (Hz)"} <= set(text)
    assert "hot: 0.0\u00a0%" in text and "calm: 100.0\u00a0%" in text


def test_an_axis_without_modes_has_no_bands_of_them(found: Design, labels_of: Labels) -> None:
    text = labels_of(lambda: axis_response(found.plant, found.notches, found.nominal.units))
    assert "resonances" not in text and "frequency (Hz)" in text
    assert any("deg/(deg/s)" in line for line in text)


def test_crossovers_say_how_far_each_filter_goes(found: Design, labels_of: Labels) -> None:
    text = labels_of(lambda: crossover_allowance(found.crossovers, 0.95, "gain margin of 6 dB"))
    assert len([line for line in text if "up to" in line]) == len(found.crossovers) == 2


def test_predicted_and_simulated_cycles_are_paired_by_draw(found: Design, labels_of: Labels) -> None:
    check = found.loops[0].cycles[0]
    predicted, simulated = check.matched("frequency_hz")
    assert len(predicted) == 20
    np.testing.assert_allclose(predicted, simulated, rtol=0.05)
    text = labels_of(lambda: limit_cycle_check(found.loops[:1], "deg"))
    assert "predicted amplitude of w (deg)" in text and "hot" in text


@pytest.mark.slow
def test_loops_and_tests_have_a_row_and_a_column(found: Design, labels_of: Labels) -> None:
    for draw in (
        lambda: nyquist_and_sensitivities(found.loops),
        lambda: time_responses(found.loops, found.nominal.units),
    ):
        text = labels_of(draw)
        assert "hot" in text and "calm" in text
    assert {"ramp: error", "sidereal: error", "time (s)", "output (deg)"} <= set(text)


@pytest.mark.slow
def test_sets_have_a_panel_each(found: Design, labels_of: Labels) -> None:
    text = labels_of(lambda: uncertainty_sets(found.sets, found.nominal.units))
    assert {"multiplicative", "additive", "|W|, order 3"} <= set(text)
