"""Margins of many draws: against their own definition, against python-control, and against the clock."""

from __future__ import annotations

import time
from dataclasses import replace

import control
import numpy as np
import pytest
from printed.nanshan import nanshan_model
from spread_axis import spread_posterior

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import Margins, Requirements, loop_margins

CONTROLLERS = (
    Controller("PI", 20.0, 1.2, 0.3),
    Controller("PI at 10 Hz", 10.0, 1.0, 0.2),
    Controller("PID", 20.0, 1.2, 0.3, 0.2, 0.1, low_pass_hz=4.0),
)


@pytest.mark.parametrize("controller", CONTROLLERS, ids=lambda c: c.name)
def test_the_gain_margin_is_where_a_pole_reaches_the_circle(axis: AxisDraws, controller: Controller) -> None:
    """An independent road: eigenvalues of the loop with the margin as a factor."""
    loop = Loop(axis, controller)
    margins = loop_margins(loop)
    assert margins.stable.all()
    factor = 10 ** (margins.gain_margin_db / 20)
    np.testing.assert_allclose(loop.spectral_radius(factor), 1, atol=2e-6)
    assert (loop.spectral_radius(factor * 1.01) > 1).all()


def test_the_delay_margin_is_where_whole_samples_destabilise(axis: AxisDraws) -> None:
    """Delays of whole samples up to the margin leave the loop stable, the next one does not."""
    controller = Controller("P", 20.0, 1.5)
    margins = loop_margins(Loop(axis, controller))
    whole = np.floor(margins.delay_margin_s * 20.0)
    for samples in np.unique(whole):
        kept = axis.take(np.flatnonzero(whole == samples))
        for extra, stable in ((int(samples), True), (int(samples) + 1, False)):
            late = Loop(kept, replace(controller, delay_samples=extra))
            assert ((late.spectral_radius() < 1) == stable).all()


@pytest.mark.parametrize(
    "controller",
    [CONTROLLERS[0], pytest.param(CONTROLLERS[1], marks=pytest.mark.slow), CONTROLLERS[2]],
    ids=lambda c: c.name,
)
def test_margins_are_those_of_python_control(axis: AxisDraws, controller: Controller) -> None:
    """From its frequency-response data on a fine grid: its polynomial method finds crossings that are not
    there where poles cluster at z = 1."""
    loop = Loop(axis.take(np.arange(2)), controller)
    margins = loop_margins(loop)
    frequency = np.unique(np.concatenate([loop.frequency_hz, np.linspace(0.05, loop.nyquist_hz, 6000)]))
    for draw, response in enumerate(loop.response(frequency)):
        data = control.frd(response, 2 * np.pi * frequency, smooth=True)
        gain, phase, modulus, _, _, _ = control.stability_margins(data)
        assert margins.gain_margin_db[draw] == pytest.approx(20 * np.log10(gain), abs=1e-3)
        assert margins.phase_margin_deg[draw] == pytest.approx(phase, abs=1e-2)
        assert margins.modulus_margin[draw] == pytest.approx(modulus, abs=2e-3)


def test_bandwidth_and_crossover_are_where_they_say(axis: AxisDraws, controller: Controller) -> None:
    loop = Loop(axis, controller)
    margins = loop_margins(loop)
    draws = np.arange(axis.count)
    response = loop.response_at(draws, margins.bandwidth_hz)
    np.testing.assert_allclose(np.abs(response / (1 + response)), np.sqrt(0.5), rtol=2e-3)
    np.testing.assert_allclose(np.abs(loop.response_at(draws, margins.crossover_hz)), 1, rtol=1e-6)
    at_phase = loop.response_at(draws, margins.phase_crossover_hz)
    np.testing.assert_allclose(np.abs(np.angle(at_phase)), np.pi, atol=1e-4)


def test_unstable_draws_have_no_margins(axis: AxisDraws) -> None:
    """A gain between the margins of the draws splits them as the eigenvalues do."""
    gain = float(np.median(10 ** (loop_margins(Loop(axis, Controller("P", 20.0, 1.0))).gain_margin_db / 20)))
    margins = loop_margins(Loop(axis, Controller("P", 20.0, gain)))
    assert 0.4 < np.mean(margins.stable) < 0.6
    assert np.isnan(margins.gain_margin_db[~margins.stable]).all()
    assert np.isfinite(margins.gain_margin_db[margins.stable]).all()
    assert not margins.meets(Requirements(0, 0, 0))[~margins.stable].any()


def test_conditional_stability_shows_as_gain_that_may_not_fall() -> None:
    """Around the 26 m model an integral too strong for its gain leaves stability when the gain falls."""
    axis = AxisDraws.nominal(spread_posterior(nanshan_model()))
    loop = Loop(axis, Controller("PI", 20.0, 30.0, 60.0))
    margins = loop_margins(loop)
    assert margins.stable[0] and np.isfinite(margins.gain_reduction_db[0])
    factor = 10 ** (-margins.gain_reduction_db / 20)
    assert loop.spectral_radius(factor)[0] == pytest.approx(1, abs=2e-6)


def test_requirements_are_all_asked_for() -> None:
    one = np.array([1.0])
    margins = Margins(0.9 * one, 6 * one, 9 * one, 45 * one, 0.1 * one, one, one, one, one)
    assert margins.meets(Requirements(6, 45, 0.1)).all()
    for worse in (Requirements(6.1, 45, 0.1), Requirements(6, 45.1, 0.1), Requirements(6, 45, 0.11)):
        assert not margins.meets(worse).any()
    assert Requirements(6, 45).describe() == "gain margin of 6 dB and phase margin of 45 deg"
    asked = "gain margin of 6 dB, phase margin of 45 deg and delay margin of 0.1 s"
    assert Requirements(6, 45, 0.1).describe() == asked


def test_two_thousand_draws_in_two_seconds() -> None:
    """Of the 26 m model, the grid, poles and refinement included."""
    posterior = spread_posterior(nanshan_model(), "conditional", spread=0.01)
    values = posterior.draws(2000, np.random.default_rng(1))
    begin = time.perf_counter()
    margins = loop_margins(Loop(AxisDraws.of_posterior(posterior, values), Controller("PI", 20.0, 20.0, 5.0)))
    assert time.perf_counter() - begin < 2.0
    assert len(margins.radius) == 2000
