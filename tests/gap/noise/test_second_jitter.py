"""Slow noise with clock jitter beside it: both are told, and neither where the other is alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from drive_axis import SIGMA, coloured, white
from fitted import SAMPLES, explained, with_residuals
from test_clock_jitter import untimely
from test_slow_noise import gusts, seen

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.clock_jitter import CLOCK_SD, Untimely, clock_jitter
from bayes_hw.gap.noise.second_jitter import SecondJitter, spread_with_speed
from bayes_hw.gap.noise.slow_noise import random_walk, wind
from bayes_hw.gap.noise.stochastic import StochasticFit
from bayes_hw.gap.noise.two_causes import both as beside
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each

SPREAD = 0.03


def walking(step: float = 0.3 * SIGMA) -> list[FloatArray]:
    steps = [np.cumsum(white(SAMPLES, step, 10 + i)) for i in range(2)]
    return [w + coloured(SAMPLES, SIGMA, 0.0, i) for i, w in enumerate(steps)]


@pytest.mark.parametrize(
    ("slow", "both", "alone"),
    [
        (walking(), beside(random_walk, SecondJitter.of), random_walk),
        (seen(gusts(0.2, 0.8, 3.0)), beside(wind, SecondJitter.of), wind),
    ],
    ids=["walk", "wind"],
)
def test_parameters_are_those_of_either_alone(
    slow: list[FloatArray],
    both: Callable[..., StochasticFit | None],
    alone: Callable[..., StochasticFit | None],
) -> None:
    """The slow noise to 15 % of a fit without jitter, the jitter to 10 %; far likelier than either alone."""
    clean, fit = alone(with_residuals(slow)), with_residuals(untimely(slow, SPREAD))
    found = both(fit)
    assert clean is not None and found is not None
    assert found.labels == (clean.label, "timing_jitter")
    size = "sensor_drift.step_sd" if clean.label == "sensor_drift" else "wind.sd"
    assert found.parameters[size][0] == pytest.approx(clean.parameters[size][0], rel=0.15)
    assert found.size == pytest.approx(clean.size, rel=0.05)
    value, error, unit = found.parameters[CLOCK_SD]
    assert unit == "s" and value == pytest.approx(SPREAD, rel=0.1)
    assert 0.01 * SPREAD < error < 0.1 * SPREAD
    rivals = [alone(fit), clock_jitter(fit)]
    assert all(r is None or found.log_likelihood > r.log_likelihood + 50 for r in rivals)


def test_without_a_spread_that_grows_with_the_speed_there_are_not_two() -> None:
    fit = with_residuals(walking())
    assert beside(random_walk, SecondJitter.of)(fit) is None and beside(wind, SecondJitter.of)(fit) is None


def test_departures_from_neighbours_tell_the_spread() -> None:
    """A first guess, to a quarter: whatever is slow beneath, and with glitches; zero without jitter."""
    fit = with_residuals(untimely(walking(), SPREAD))
    speeds = Untimely.of(fit).speeds
    assert np.sqrt(spread_with_speed(fit.residuals, speeds)) == pytest.approx(SPREAD, rel=0.25)
    spoilt = [e + 100 * SIGMA * (np.arange(SAMPLES) % 301 == 300) for e in fit.residuals]
    assert np.sqrt(spread_with_speed(spoilt, speeds)) == pytest.approx(SPREAD, rel=0.25)
    assert spread_with_speed(walking(), speeds) == 0


def test_the_search_finds_both() -> None:
    start = explained(untimely(walking(), SPREAD))
    labels = frozenset({"timing_jitter", "wind", "sensor_drift"})
    search = StochasticSearch(start.fit.measured, labels, SIGMA, Each(1))
    alone = search.beside(start, [], [])
    best = max([*alone, *search.two_at_once(start, alone)], key=lambda e: e.log_evidence)
    assert best.labels == ("sensor_drift", "timing_jitter")
    assert best.name == "sensor_drift (random walk, with clock jitter)"
    calm = explained(walking())
    quiet = StochasticSearch(calm.fit.measured, labels, SIGMA, Each(1))
    assert quiet.two_at_once(calm, quiet.beside(calm, [], [])) == []
