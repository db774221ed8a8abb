"""The closed fraction is of the axis's angle: what readings add neither hides nor feigns closure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SAMPLES, SIGMA, form, measured, record, response_with, some_effect

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH, PROBABILITY
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.noise.reading_faults import MASK
from bayes_hw.gap.joint.posterior.joint_closure import (
    Floor,
    closure_of,
    differ,
    of_axis,
    rms,
    shown_spread,
    spread,
    walks,
    without_glitches,
)
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Record

N = 4000
ANGLE = 0.5 * np.sin(np.arange(N) / 200)
BEFORE = ANGLE + 0.003 * np.sin(np.arange(N) / 9)


def closed(y: FloatArray, after: FloatArray, floor: Floor) -> tuple[float, float, float]:
    """Fraction and interval of one record, draws of the truth about `after`."""
    rng = np.random.default_rng(2)
    drawn = [[after + 3e-4 * rng.standard_normal() * np.sin(np.arange(N) / 50)] for _ in range(40)]
    found = closure_of([y], [BEFORE], [after], drawn, floor, rng)
    return found.closed, *found.closed_hdi94


def fit_of(records: list[Record], effects: tuple[Effect, ...] = ()) -> JointFit:
    """The axis at its true values with `effects`, on records."""
    shown, _ = response_with(effects, SAMPLES)
    response = JointResponse(shown.structure, effects, records, shown.scale)
    return JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE, effects))))


def test_rounding_is_no_avoidable_error() -> None:
    """Its size is that of the training residuals: as the encoder's noise alone it would feign a gap."""
    step = 5 * SIGMA
    plain = measured((), SAMPLES, (1, 2))
    rounded = [record(step * np.round(r.y / step), i + 1) for i, r in enumerate(plain)]
    fit = fit_of(rounded)
    floor = Floor.of(fit, ("encoder_quantization",), SIGMA)
    noisy = ANGLE + SIGMA * np.random.default_rng(3).standard_normal(N)
    y = step * np.round(noisy / step)
    _, low, high = closed(y, ANGLE + 1e-5, floor)
    assert low <= 1 <= high + 1e-9
    assert closed(y, ANGLE + 1e-5, Floor(SIGMA, 0.02 * SIGMA, SIGMA))[2] < 0.5


@pytest.mark.parametrize("share", [0.0, 0.005, 0.1])
def test_readings_that_are_left_out_belong_to_what_is_shown(share: float) -> None:
    """A normal band of the spread of all readings holds 94 % of them, those beyond it included; few of them
    change nothing, and neither changes the encoder's own noise."""
    rng, records, weights = np.random.default_rng(8), [], []
    for plain in measured((), SAMPLES, (1, 2, 3, 4, 5, 6)):
        far = rng.random(SAMPLES) < share
        records.append(replace(plain, y=plain.y + np.where(far, 20 * SIGMA, 0.0)))
        weights.append(np.where(far, MASK, 1.0))
    response = replace(fit_of(records).response, weights=tuple(weights))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE, ()))))
    errors = np.abs(np.concatenate(fit.errors))
    held = float(np.mean(errors <= NORMAL_HALF_WIDTH * shown_spread(fit)))
    assert held == pytest.approx(PROBABILITY, abs=0.012)
    assert spread(fit) == pytest.approx(SIGMA, rel=0.05)
    if share < 0.01:
        assert shown_spread(fit) == pytest.approx(SIGMA, rel=0.08)


def test_one_simulation_in_other_coordinates_does_not_differ() -> None:
    """Rounding is no change, and closes nothing; a thousandth of the error is one."""
    error = rms([ANGLE], [BEFORE])
    assert not differ(BEFORE, BEFORE * (1 + 1e-15), error)
    assert differ(BEFORE, BEFORE + 1e-3 * error, error)
    assert closed(ANGLE, BEFORE * (1 + 1e-15), Floor(SIGMA, 0.02 * SIGMA, SIGMA)) == (0.0, 0.0, 0.0)


def test_readings_that_walk_do_not_tell_what_is_left() -> None:
    walk = np.cumsum(1e-3 * np.random.default_rng(4).standard_normal(N))
    y = ANGLE + walk + SIGMA * np.random.default_rng(5).standard_normal(N)
    middle, low, high = closed(y, ANGLE + 1e-5, Floor(SIGMA, 0.02 * SIGMA, SIGMA, hidden=True))
    assert 0.9 < low <= middle <= high == 1.0
    assert closed(y, ANGLE + 1e-5, Floor(SIGMA, 0.02 * SIGMA, SIGMA))[2] < 0.5


def test_the_size_of_errors_is_of_what_was_measured() -> None:
    measured_in, predicted = (
        [np.array([3.0, np.nan]), np.array([5.0])],
        [np.array([1.0, 9.0]), np.array([1.0])],
    )
    assert rms(measured_in, predicted) == pytest.approx(np.sqrt((2.0**2 + 4.0**2) / 2))


def test_where_readings_walk_the_fraction_is_that_against_every_draw() -> None:
    """The median over draws of what is left against what was, in squares."""
    draws = [ANGLE + size * np.cos(np.arange(N) / 70) for size in (1e-4, 2e-4, 4e-4)]
    after = ANGLE + 3e-4 * np.sin(np.arange(N) / 31)
    floor = Floor(SIGMA, 0.02 * SIGMA, SIGMA, hidden=True)
    found = closure_of([ANGLE], [BEFORE], [after], [[d] for d in draws], floor, np.random.default_rng(1))
    against = [1 - np.sum((after - d) ** 2) / np.sum((BEFORE - d) ** 2) for d in draws]
    assert found.closed == pytest.approx(np.median(against), rel=1e-9)
    assert found.closed_hdi94[0] <= found.closed and found.closed_hdi94[1] == 1.0


def test_colour_of_the_noise_may_be_motion() -> None:
    """The upper end takes it for noise, the lower one for motion."""
    rng = np.random.default_rng(6)
    left = 0.001 * np.sin(np.arange(N) / 7)
    y = ANGLE + left + SIGMA * rng.standard_normal(N)
    true = 1 - np.mean(left**2) / np.mean((BEFORE - ANGLE - left) ** 2)
    level = float(np.sqrt(SIGMA**2 + np.mean(left**2)))
    _, low, high = closed(y, ANGLE, Floor(level, 0.01 * level, SIGMA))
    assert low <= true <= high
    assert closed(y, ANGLE, Floor(level, 0.01 * level, level))[1] > true


def test_glitches_do_not_count() -> None:
    y = ANGLE + SIGMA * np.random.default_rng(7).standard_normal(N)
    y[::97] += 0.2
    (kept,) = without_glitches([y], [ANGLE])
    assert np.isnan(kept[::97]).all()
    assert np.isnan(kept).mean() < 0.03
    assert closed(kept, ANGLE + 1e-5, Floor(SIGMA, 0.05 * SIGMA, SIGMA))[0] > 0.9


def test_the_axis_does_not_follow_the_drift_of_its_encoder() -> None:
    drift = some_effect(form("sensor_drift", "ramp"))
    fit = fit_of(measured((drift,), SAMPLES, (1, 2)), (drift,))
    u = fit.response.records[0].u
    moved, angle = (fit.response.simulate(v, u).y for v in (fit.values, of_axis(fit.values)))
    plain = fit_of(measured((), SAMPLES, (1,)))
    np.testing.assert_allclose(angle, plain.response.simulate(plain.values, u).y, atol=1e-12)
    assert np.ptp(moved - angle) > 10 * SIGMA
    assert not walks(fit, ("sensor_drift",))
    assert walks(plain, ("sensor_drift",))


def test_what_is_far_worse_than_before_is_said_so() -> None:
    y = ANGLE + SIGMA * np.random.default_rng(8).standard_normal(N)
    after = ANGLE + 0.02 * np.sin(np.arange(N) / 9)
    true = 1 - float(np.mean((after - ANGLE) ** 2) / np.mean((BEFORE - ANGLE) ** 2))
    _, low, high = closed(y, after, Floor(SIGMA, 0.02 * SIGMA, SIGMA))
    assert low <= true <= high < -20


def test_one_simulation_in_other_coordinates_closes_nothing() -> None:
    y = ANGLE + SIGMA * np.random.default_rng(9).standard_normal(N)
    assert closed(y, BEFORE * (1 + 1e-14), Floor(SIGMA, 0.02 * SIGMA, SIGMA)) == (0.0, 0.0, 0.0)
