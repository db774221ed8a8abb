"""Samples off their instants: the spread of the clock is found again, of slow motion and of vibrations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import RATE, SIGMA, coloured
from fitted import SAMPLES, base, with_residuals
from scipy.interpolate import CubicSpline

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.clock_jitter import Untimely, clock_jitter
from bayes_hw.gap.noise.stochastic import autoregression

RECORDS = 2


def noise(correlation: float = 0.3) -> list[FloatArray]:
    return [coloured(SAMPLES, SIGMA, correlation, seed) for seed in range(RECORDS)]


def outputs() -> list[FloatArray]:
    found = base()
    return found.simulate(found.builder.axis.nominal)


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
    found = clock_jitter(replace(with_residuals(residuals), simulated=[clean] * RECORDS))
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
