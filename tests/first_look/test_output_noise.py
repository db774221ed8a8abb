"""Noise of known size and colour, readings of a known step."""

from __future__ import annotations

import numpy as np
import pytest
from simulated_axes import delayed_integrator, linear_twin, measured

from bayes_hw.arrays import white_sigma
from bayes_hw.column_roles.reading_step import resolution
from bayes_hw.first_look.look import look
from bayes_hw.first_look.noise import drift


@pytest.mark.parametrize("sigma", [pytest.param(1e-4, marks=pytest.mark.slow), 1e-2])
def test_white_noise(sigma: float) -> None:
    rng = np.random.default_rng(1)
    u = np.sin(np.arange(4000) / 15) + 0.3 * rng.standard_normal(4000)
    seen = look([delayed_integrator(u, 50.0, 2, sigma, rng)])
    assert seen.noise_sigma == pytest.approx(sigma, rel=0.05)
    assert seen.white_sigma <= seen.noise_sigma


def test_coloured_noise_has_its_marginal_size() -> None:
    rng = np.random.default_rng(2)
    seen = look([measured(linear_twin(), 0.1 * rng.standard_normal(4000), 0.002, rng)])
    assert seen.noise_sigma == pytest.approx(0.002, rel=0.08)


@pytest.mark.parametrize("step", [0.0007, 360 / 2**16, 0.0123])
def test_step_of_rounded_readings(step: float) -> None:
    y = np.cumsum(np.random.default_rng(3).standard_normal(3000)) * 0.002 + 134.2
    assert resolution([np.round(y / step) * step], 0.002) == pytest.approx(step, rel=1e-6)


def test_no_step_of_smooth_readings_nor_of_printed_ones() -> None:
    y = np.cumsum(np.random.default_rng(4).standard_normal(3000)) * 0.002
    assert resolution([y], 0.002) is None
    assert resolution([np.round(y, 6)], 0.002) is None
    assert resolution([np.zeros(100)], 0.002) is None


def test_drift_is_a_slope_per_hour() -> None:
    error = np.linspace(0, 0.5, 72_000) + 0.01 * np.random.default_rng(5).standard_normal(72_000)
    slope, spread = drift(error, 20.0)
    assert slope == pytest.approx(0.5, abs=4 * spread)
    assert spread < 0.01


def test_white_sigma_is_that_of_the_fast_part() -> None:
    y = np.sin(np.arange(5000) / 100) + 0.01 * np.random.default_rng(6).standard_normal(5000)
    assert white_sigma([y]) == pytest.approx(0.01, rel=0.05)
