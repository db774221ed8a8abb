"""Spectra of residuals and the autoregression that stands for one."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import RATE, coloured

from bayes_hw.gap.noise.spectra import first_order_spectrum, mean_spectrum, whittle

N = 4000
SIGMA, PHI = 0.02, 0.7


def test_power_integrates_to_the_variance() -> None:
    """First-order noise: by formula over all frequencies, and the mean periodogram follows it."""
    grid = np.linspace(0, RATE / 2, 20_001)
    power = first_order_spectrum(grid, RATE, SIGMA, PHI)
    assert np.trapezoid(power, grid) / (RATE / 2) == pytest.approx(SIGMA**2, rel=1e-6)
    found = mean_spectrum([coloured(N, SIGMA, PHI, seed) for seed in range(8)], RATE)
    expected = first_order_spectrum(found.frequencies, RATE, SIGMA, PHI)
    ratio = found.power / expected
    assert np.average(ratio, weights=found.counts) == pytest.approx(1, abs=0.03)
    assert np.all(np.abs(ratio - 1) < 6 / np.sqrt(found.counts) + 0.1)


def test_whittle_is_least_at_the_truth() -> None:
    found = mean_spectrum([coloured(N, SIGMA, PHI, seed) for seed in range(4)], RATE)

    def at(sigma: float, correlation: float) -> float:
        return whittle(found, first_order_spectrum(found.frequencies, RATE, sigma, correlation))

    best = at(SIGMA, PHI)
    assert best < min(at(1.15 * SIGMA, PHI), at(0.85 * SIGMA, PHI), at(SIGMA, 0.6), at(SIGMA, 0.8))
