"""Uncertainty sets hold the share of draws that they promise, on draws that they have not seen."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.loop import Loop
from bayes_hw.control.python_control import weight_system
from bayes_hw.control.uncertainty import (
    KINDS,
    UncertaintySet,
    covers,
    distances,
    robustness_peak,
    uncertainty_set,
)
from bayes_hw.infer.posterior import Posterior


@pytest.fixture(scope="module")
def halves(posterior: Posterior) -> tuple[AxisDraws, AxisDraws]:
    values = posterior.draws(2400, np.random.default_rng(5))
    return AxisDraws.of_posterior(posterior, values[:1200]), AxisDraws.of_posterior(posterior, values[1200:])


@pytest.fixture(scope="module", params=KINDS)
def found(
    request: pytest.FixtureRequest, nominal: AxisDraws, halves: tuple[AxisDraws, AxisDraws]
) -> UncertaintySet:
    return uncertainty_set(request.param, nominal, *halves, 0.9)


def test_the_share_holds_on_fresh_draws(found: UncertaintySet) -> None:
    """Three standard errors of both counts; and no set is much larger than it need be."""
    for achieved, (low, high) in zip(found.achieved, found.intervals, strict=True):
        assert 0.9 - 0.025 < achieved < 0.9 + 0.045
        assert low < achieved < high


def test_what_is_reported_is_what_is_counted(
    found: UncertaintySet, nominal: AxisDraws, halves: tuple[AxisDraws, AxisDraws]
) -> None:
    """With the weight as a system of python-control and the distance written out."""
    fresh = halves[1]
    frequency = found.frequency_hz
    centre, response = nominal.response(frequency), fresh.response(frequency)
    distance = np.abs(response / centre - 1) if found.kind == "multiplicative" else np.abs(response - centre)
    np.testing.assert_allclose(distances(found.kind, nominal, fresh, frequency), distance, rtol=1e-9)
    size = np.abs(weight_system(found.weights[1])(np.exp(2j * np.pi * frequency[:-1] / 20.0)))
    inside = np.mean(np.all(distance[:, :-1] <= size * (1 + 1e-9), axis=1))
    assert inside == pytest.approx(found.achieved[1], abs=0.01)


def test_the_weight_of_higher_order_is_no_larger(found: UncertaintySet) -> None:
    share = np.gradient(np.log(found.frequency_hz))
    size = [float(np.log(w.magnitude(found.frequency_hz)) @ share / share.sum()) for w in found.weights]
    assert size[1] < size[0] + 0.1 and size[2] < size[1] + 0.1


def test_a_draw_outside_at_one_frequency_is_outside(found: UncertaintySet) -> None:
    size = found.weights[0].magnitude(found.frequency_hz)
    distance = np.stack([0.9 * size, 0.9 * size])
    distance[1, 7] = 1.1 * size[7]
    assert covers(found.weights[0], found.frequency_hz, distance).tolist() == [True, False]


def test_small_gain_below_one_keeps_every_draw_of_the_set_stable(
    nominal: AxisDraws, halves: tuple[AxisDraws, AxisDraws]
) -> None:
    """Where |W T| < 1, the draws inside the set are stable; with far more gain it is not below one."""
    found = uncertainty_set("multiplicative", nominal, *halves, 0.9)
    controller = Controller("PI", 20.0, 1.2, 0.3)
    peak = robustness_peak(found.weights[2], Loop(nominal, controller), found.frequency_hz)
    assert peak < 1
    assert (Loop(halves[1], controller).spectral_radius() < 1).all()
    hot = Controller("P", 20.0, 4.2)
    assert robustness_peak(found.weights[2], Loop(nominal, hot), found.frequency_hz) > peak
