"""Draws about a given model, against derivatives by differences and the names of what is added to G."""

from __future__ import annotations

import numpy as np
import pytest
from joint_axis import GIVEN_SAMPLES, RATE, measured, model

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.given.given_base import best_base
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.posterior.given_posterior import INFLATION, laplace_given, unfolded
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.record import Units

NAMES = ("saturation.lower", "saturation.upper", "dead_zone.half_width", "gain")


@pytest.fixture(scope="module")
def base() -> GivenFit:
    """Of commands none of which is just at a limit, where differences see a kink."""
    return best_base(measured((), GIVEN_SAMPLES, (6, 7)), model())


def _precision(fit: GivenFit) -> FloatArray:
    """Of likelihood and prior (size, size) under white noise, from residuals at either side of the fit."""
    assert fit.noise_order == 0
    size, step = fit.response.size, 1e-5

    def at(move: FloatArray) -> FloatArray:
        found = evaluate(fit.response, fit.point.coordinates + move, fit.point.whitener)
        return np.concatenate(found.residuals)

    rows = np.array([(at(move) - at(-move)) / (2 * step) for move in step * np.eye(size)])
    variance = fit.point.sum_of_squares / fit.point.samples
    return np.asarray(rows @ rows.T / variance + np.diag(fit.response.prior_precision()))


def test_deviations_are_those_of_likelihood_and_prior_widened(base: GivenFit) -> None:
    drawn = laplace_given(base, Units(), np.random.default_rng(2)).base
    expected = INFLATION * np.sqrt(np.diag(np.linalg.inv(_precision(base))))
    for row, name in enumerate(NAMES):
        assert np.std(np.log(np.abs(drawn[name]))) == pytest.approx(expected[row], rel=0.2)
        assert np.median(drawn[name]) == pytest.approx(base.response.given.named(base.theta)[name], rel=0.02)
    assert np.std(np.log(drawn["mode1.frequency_hz"])) == pytest.approx(expected[4], rel=0.2)
    assert np.std(np.log(drawn["mode1.damping_ratio"])) == pytest.approx(expected[5], rel=0.2)


def test_what_is_added_to_g_is_told_in_its_own_numbers(base: GivenFit) -> None:
    plain = laplace_given(base, Units(), np.random.default_rng(2))
    assert not {name for name in plain.effects if name.startswith(("transport_delay", "unmodelled_mode"))}
    larger = base.with_delay(1, 0.4).with_mode(3.0, 0.05)
    drawn = laplace_given(larger, Units(), np.random.default_rng(2), 1e-6)
    assert np.mean(drawn.effects["transport_delay.time"]) == pytest.approx(1.4 / RATE, rel=1e-3)
    assert np.mean(drawn.effects["unmodelled_mode.frequency"]) == pytest.approx(3.0, rel=1e-3)
    assert np.mean(drawn.effects["unmodelled_mode.damping_ratio"]) == pytest.approx(0.05, rel=1e-2)
    assert drawn.units["transport_delay.time"] == "s" and drawn.units["unmodelled_mode.frequency"] == "Hz"


def test_with_free_sections_it_moves_as_around_the_model(base: GivenFit) -> None:
    late = base.with_delay(1, 0.4)
    free = unfolded(late)
    for number in range(len(late.response.records)):
        ours = free.response.along(free.values, number).y
        np.testing.assert_allclose(ours, late.response.along(late.values, number).y, atol=1e-9)
