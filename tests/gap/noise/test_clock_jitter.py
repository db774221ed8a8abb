"""Samples off their instants are found alone and beside slow noise, and not where the other is alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from drive_axis import RATE, SIGMA
from fitted import SAMPLES, explained, noise, outputs, walking, with_residuals
from scipy.interpolate import CubicSpline
from test_slow_noise import gusts, seen

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.clock_jitter import CLOCK_SD, SecondJitter, Untimely, clock_jitter, spread_with_speed
from bayes_hw.gap.noise.slow_noise import random_walk, wind
from bayes_hw.gap.noise.stochastic_fit import StochasticFit, autoregression
from bayes_hw.gap.noise.two_causes import both as beside
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each


def untimely(residuals: list[FloatArray], spread: float, seed: int = 6) -> list[FloatArray]:
    """The same where every sample of the axis is off its instant by a normal number of `spread` seconds."""
    rng, instants = np.random.default_rng(seed), np.arange(SAMPLES) / RATE
    return [
        e + CubicSpline(instants, y)(instants + rng.normal(0, spread, SAMPLES)) - y
        for e, y in zip(residuals, outputs(), strict=True)
    ]


def test_clock_jitter() -> None:
    """The spread of the sampling instants to 15 %."""
    spread, residuals = 0.03, untimely(noise(), 0.03)
    fit = with_residuals(residuals)
    found = clock_jitter(fit)
    assert found is not None and (found.label, found.form) == ("timing_jitter", "clock")
    assert found.parameters["timing_jitter.clock_sd"][0] == pytest.approx(spread, rel=0.15)
    assert found.log_likelihood > autoregression(fit).log_likelihood + 50
    innovations = found.whitener.whiten(residuals[0][:, None], 0)
    assert innovations.std() == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("spread", [0.01, 0.02])
def test_clock_jitter_of_vibrations(spread: float) -> None:
    """Five samples a cycle: differences of samples would lose a quarter of the speed."""
    rng, instants = np.random.default_rng(8), np.arange(SAMPLES) / RATE

    def vibration(t: FloatArray) -> FloatArray:
        return 10 * SIGMA * np.sin(2 * np.pi * 4.0 * t)

    clean = vibration(instants)
    residuals = [e + vibration(instants + rng.normal(0, spread, SAMPLES)) - clean for e in noise(0.0)]
    found = clock_jitter(replace(with_residuals(residuals), simulated=[clean] * len(residuals)))
    assert found is not None
    assert found.parameters["timing_jitter.clock_sd"][0] == pytest.approx(spread, rel=0.08)


def test_variances_are_those_of_a_shifted_sine() -> None:
    """To fourth order in tau: (1 - cos) and sine in closed form, averaged over instants."""
    rate, omega, tau = 200.0, 2 * np.pi * 1.0, 0.02
    t = np.arange(2000) / rate
    fit = with_residuals([np.zeros(2000)])
    scale = replace(fit.hypothesis.scale, rate=rate)
    moving = replace(fit, hypothesis=replace(fit.hypothesis, scale=scale), simulated=[np.sin(omega * t)])
    found = Untimely.of(moving).variances(tau**2)[0]
    epsilon = np.random.default_rng(1).normal(0, tau, 200_000)
    for k in (500, 537, 550):
        exact = np.mean((np.sin(omega * (t[k] + epsilon)) - np.sin(omega * t[k])) ** 2)
        assert found[k] == pytest.approx(exact, rel=0.05, abs=2e-6)


SPREAD = 0.03


@pytest.mark.parametrize(
    ("slow", "both", "alone"),
    [
        (walking(), beside(random_walk, SecondJitter.of), random_walk),
        pytest.param(seen(gusts(0.2, 0.8, 3.0)), beside(wind, SecondJitter.of), wind, marks=pytest.mark.slow),
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


@pytest.mark.slow
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
