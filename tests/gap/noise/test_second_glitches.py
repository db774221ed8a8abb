"""Slow noise with glitches beside it: both are told, and the one does not spoil the other."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from drive_axis import SIGMA, coloured, white
from fitted import SAMPLES, explained, with_residuals
from test_slow_noise import gusts, seen

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.second_glitches import SecondGlitches
from bayes_hw.gap.noise.slow_noise import random_walk, wind
from bayes_hw.gap.noise.stochastic import StochasticFit, outliers
from bayes_hw.gap.noise.two_causes import both as beside
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each

PLACES = np.array([100, 321, 480, 700, 777, 1010])
HEIGHT = 60 * SIGMA


def spoilt(residuals: list[FloatArray]) -> list[FloatArray]:
    """The same with glitches, half of them down."""
    return [
        e + HEIGHT * np.isin(np.arange(len(e)), PLACES) * np.cos(np.arange(len(e)) * np.pi) for e in residuals
    ]


def walking(step: float = 0.1 * SIGMA) -> list[FloatArray]:
    steps = [np.cumsum(white(SAMPLES, step, 10 + i)) for i in range(2)]
    return [w + coloured(SAMPLES, SIGMA, 0.3, i) for i, w in enumerate(steps)]


@pytest.mark.parametrize(
    ("slow", "both", "alone"),
    [
        (walking(), beside(random_walk, SecondGlitches.of), random_walk),
        (seen(gusts(0.2, 0.8, 3.0)), beside(wind, SecondGlitches.of), wind),
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
    fit = with_residuals(walking())
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
