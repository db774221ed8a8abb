"""Isolated samples are found, and beside slow noise both are told, neither spoiling the other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from drive_axis import SIGMA, coloured, white
from fitted import SAMPLES, explained, noise, walking, with_residuals
from test_slow_noise import gusts, seen

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.glitches import FEWEST, Glitches, SecondGlitches, find_glitches, outliers
from bayes_hw.gap.noise.slow_noise import random_walk, wind
from bayes_hw.gap.noise.stochastic_fit import StochasticFit, autoregression
from bayes_hw.gap.noise.two_causes import both as beside
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each


def test_glitches_are_found_and_noise_is_not() -> None:
    e = coloured(2000, 1.0, 0.8, seed=1)
    places = np.array([0, 5, 300, 301, 1500, 1999])
    spoilt = e.copy()
    spoilt[places] += np.array([12, -15, 20, -20, 12, 14])
    clean, masks = find_glitches([e]), find_glitches([spoilt, e])
    assert clean[0].sum() <= 1
    assert set(places) <= set(np.flatnonzero(masks[0]))
    assert masks[0].sum() <= len(places) + 1


def test_slow_bumps_and_steps_are_no_glitches() -> None:
    e = white(1000, 1.0, 2) + np.where(np.arange(1000) > 500, 30.0, 0.0)
    assert find_glitches([e])[0].sum() <= 3


def test_many_far_samples_are_another_distribution() -> None:
    """Nor is anything found where the residual does not move at all."""
    rng = np.random.default_rng(3)
    e = np.where(rng.random(1000) < 0.2, 30 * rng.normal(size=1000), rng.normal(size=1000))
    assert not find_glitches([e])[0].any()
    assert not find_glitches([np.zeros(100)])[0].any()


def test_the_likelihood_of_places_and_heights() -> None:
    """That of independent places and of normal heights, both at their own estimates, worked out sample by
    sample; slow motion beneath them does not count as height."""
    heights = np.array([50.0, -40.0, 60.0, -50.0])
    e = 3 * np.sin(np.arange(900) / 90.0) + 0.1 * white(900, 1.0, 8)
    e[[40, 200, 377, 650]] += heights
    found = Glitches.of([e])
    assert found is not None and found.found == 4 and found.rate == 4 / 900
    assert found.height == pytest.approx(np.sqrt(np.mean(np.square([50, 40, 60, 50]))), rel=0.01)
    each = [
        -0.5 * np.log(2 * np.pi * found.height**2) - 0.5 * (h / found.height) ** 2 for h in (50, 40, 60, 50)
    ]
    places_known = 4 * np.log(4 / 900) + 896 * np.log(896 / 900)
    assert found.log_likelihood == pytest.approx(np.sum(each) + places_known, rel=0.01)


def test_too_few_are_no_effect() -> None:
    e = white(900, 1.0, 6)
    e[np.arange(FEWEST - 1) * 200 + 50] += 40.0
    assert Glitches.of([e]) is None


def test_ringing_is_no_glitches() -> None:
    """A burst at a quarter of the sample rate departs from its neighbours' median, many times in a row."""
    k = np.arange(2000)
    burst = 30 * np.exp(-(((k - 900) / 25.0) ** 2)) * np.sin(0.5 * np.pi * k + 0.3)
    assert not find_glitches([white(2000, 1.0, 9) + burst])[0].any()


def test_outliers() -> None:
    """Rate and height within three of their own errors; more likely than one noise."""
    rng, residuals = np.random.default_rng(5), noise()
    for e in residuals:
        e += np.where(rng.random(SAMPLES) < 0.01, rng.normal(0, 30 * SIGMA, SAMPLES), 0)
    fit = with_residuals(residuals)
    found = outliers(fit)
    assert found is not None and found.label == "outliers"
    rate, error, _ = found.parameters["outliers.rate"]
    assert abs(rate - 0.01 * 0.8) < 3 * error + 0.002
    assert found.parameters["outliers.height"][0] == pytest.approx(30 * SIGMA, rel=0.5)
    assert found.log_likelihood > autoregression(fit).log_likelihood + 100
    assert outliers(with_residuals(noise())) is None


PLACES = np.array([100, 321, 480, 700, 777, 1010])


HEIGHT = 60 * SIGMA


def spoilt(residuals: list[FloatArray]) -> list[FloatArray]:
    """The same with glitches, half of them down."""
    return [
        e + HEIGHT * np.isin(np.arange(len(e)), PLACES) * np.cos(np.arange(len(e)) * np.pi) for e in residuals
    ]


@pytest.mark.parametrize(
    ("slow", "both", "alone"),
    [
        (walking(0.1 * SIGMA, 0.3), beside(random_walk, SecondGlitches.of), random_walk),
        pytest.param(
            seen(gusts(0.2, 0.8, 3.0)), beside(wind, SecondGlitches.of), wind, marks=pytest.mark.slow
        ),
    ],
    ids=["walk", "wind"],
)
def test_parameters_are_those_without_the_glitches(
    slow: list[FloatArray],
    both: Callable[..., StochasticFit | None],
    alone: Callable[..., StochasticFit | None],
) -> None:
    """Sizes to 15 % and the encoder's noise to 5 % of a fit to the records before they were spoilt; height
    and rate of the glitches; and far likelier than either alone."""
    clean, fit = alone(with_residuals(slow)), with_residuals(spoilt(slow))
    found = both(fit)
    assert clean is not None and found is not None
    assert found.labels == (clean.label, "outliers")
    size = "sensor_drift.step_sd" if clean.label == "sensor_drift" else "wind.sd"
    assert found.parameters[size][0] == pytest.approx(clean.parameters[size][0], rel=0.15)
    assert found.encoder_sigma == pytest.approx(clean.encoder_sigma, rel=0.05)
    assert found.parameters["outliers.height"][0] == pytest.approx(HEIGHT, rel=0.1)
    assert found.parameters["outliers.rate"][0] == pytest.approx(len(PLACES) / SAMPLES)
    rivals = [alone(fit), outliers(fit)]
    assert all(r is None or found.log_likelihood > r.log_likelihood + 100 for r in rivals)


def test_without_glitches_there_are_not_two() -> None:
    fit = with_residuals(walking(0.1 * SIGMA, 0.3))
    assert (
        beside(random_walk, SecondGlitches.of)(fit) is None and beside(wind, SecondGlitches.of)(fit) is None
    )


def test_the_search_finds_both() -> None:
    """Among all stochastic effects beside the base model, and its explanation names both."""
    start = explained(spoilt(walking(0.3 * SIGMA)))
    measured, labels = start.fit.measured, frozenset({"outliers", "wind", "sensor_drift"})
    search = StochasticSearch(measured, labels, SIGMA, Each(1))
    alone = search.beside(start, [], [])
    best = max([*alone, *search.two_at_once(start, alone)], key=lambda e: e.log_evidence)
    assert best.labels == ("outliers", "sensor_drift")
    assert best.name == "sensor_drift (random walk, with glitches)"
