"""Step, ramp and sidereal tracking against what a type-1 and a type-2 loop must do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.responses import DURATION_S, Response, TestSignals, responses
from bayes_hw.record import Units

PI = Controller("PI", 20.0, 1.5, 0.5)


def run(axis: AxisDraws, nominal: AxisDraws, controller: Controller) -> dict[str, Response]:
    noise = 0.01 * np.random.default_rng(1).standard_normal((axis.count, round(20 * DURATION_S)))
    signals = TestSignals.for_axis(nominal)
    return {r.name: r for r in responses(axis, nominal, controller, signals, noise)}


def test_a_proportional_loop_trails_a_ramp_by_the_rate_over_its_gain(
    axis: AxisDraws, nominal: AxisDraws
) -> None:
    """One that does not forget: the plain incremental form of a P loses what the limits took."""
    controller = Controller("P", 20.0, 1.5, anti_windup_s=np.inf)
    ramp = run(axis, nominal, controller)["ramp"]
    rate = TestSignals.for_axis(nominal).ramp_rate
    expected = rate / (1.5 * axis.velocity_gain())
    np.testing.assert_allclose(ramp.merits["rms error"], expected, rtol=0.01)


def test_an_integral_trails_nothing(axis: AxisDraws, nominal: AxisDraws) -> None:
    found = run(axis, nominal, PI)
    rate = TestSignals.for_axis(nominal).ramp_rate
    assert found["ramp"].merits["rms error"].max() < 0.02 * rate
    assert found["sidereal"].merits["rms error"].max() < 0.02 * rate
    assert (found["sidereal"].merits["rms error with noise"] > found["sidereal"].merits["rms error"]).all()


def test_merits_are_those_of_the_curves(nominal: AxisDraws) -> None:
    """With one draw the bands are the curve: overshoot and settling time read off it."""
    step = run(nominal, nominal, PI)["step"]
    size = TestSignals.for_axis(nominal).step
    np.testing.assert_array_equal(step.lower, step.upper)
    np.testing.assert_array_equal(step.median, step.nominal)
    assert step.merits["overshoot"][0] == pytest.approx(100 * (step.median.max() / size - 1))
    settled = step.merits["settling time"][0]
    error = np.abs(step.median - size)
    assert error[step.t >= settled].max() <= 0.02 * size
    assert error[step.t < settled][-1] > 0.02 * size


def test_a_loop_that_does_not_settle_says_infinite(nominal: AxisDraws) -> None:
    slow = replace(PI, proportional=0.01, integral=0.0)
    assert np.isinf(run(nominal, nominal, slow)["step"].merits["settling time"][0])


def test_bands_hold_the_draws(axis: AxisDraws, nominal: AxisDraws) -> None:
    for response in run(axis, nominal, PI).values():
        assert (response.lower <= response.median).all() and (response.median <= response.upper).all()
        assert set(response.units) == set(response.merits)


@pytest.mark.parametrize(("unit", "rate"), [("deg", 15.041067 / 3600), ("arcsec", 15.041067), ("m", None)])
def test_the_sky_moves_in_the_units_of_the_axis(nominal: AxisDraws, unit: str, rate: float | None) -> None:
    signals = TestSignals.for_axis(replace(nominal, units=Units("s", "V", unit)))
    assert signals.sidereal_rate == (None if rate is None else pytest.approx(rate))
    if rate is None:
        other = replace(nominal, units=Units("s", "V", unit))
        assert [r.name for r in responses(other, other, PI, signals, np.zeros((1, 1200)))] == ["step", "ramp"]
