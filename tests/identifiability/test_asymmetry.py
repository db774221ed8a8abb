"""Savage-Dickey ratios against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayes_hw.identifiability.asymmetry import log_density_ratio, log_posterior_density


def exact(measured: float, error: float, width: float) -> float:
    """log Bayes factor of x = 0 against N(0, width^2) for a measurement with a normal error."""
    alternative = stats.norm.logpdf(measured, 0, np.hypot(error, width))
    return float(stats.norm.logpdf(measured, 0, error) - alternative)


def posterior_draws(measured: float, error: float, prior_sd: float, count: int = 200_000) -> np.ndarray:
    precision = 1 / error**2 + 1 / prior_sd**2
    mean = measured / error**2 / precision
    return np.random.default_rng(1).normal(mean, precision**-0.5, count)


@pytest.mark.parametrize("measured", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("width", [0.05, 0.2, 1.0])
def test_bayes_factor_of_a_normal_measurement(measured: float, width: float) -> None:
    """Reweighted from the prior that was sampled to others."""
    draws = posterior_draws(measured, 0.02, 1.0)
    assert log_density_ratio(draws, 0.0, 1.0, width) == pytest.approx(exact(measured, 0.02, width), abs=0.1)


def test_far_out_the_normal_tail_is_used() -> None:
    draws = posterior_draws(0.3, 0.02, 1.0)
    assert log_density_ratio(draws, 0.0, 1.0, 1.0) == pytest.approx(exact(0.3, 0.02, 1.0), rel=0.02)


def test_a_prior_not_centred_on_equality() -> None:
    """Draws under N(0.5, 1) say the same as draws under N(0, 1)."""
    rng = np.random.default_rng(2)
    precision = 1 / 0.05**2 + 1
    draws = rng.normal((0.03 / 0.05**2 + 0.5) / precision, precision**-0.5, 200_000)
    assert log_density_ratio(draws, 0.5, 1.0, 0.2) == pytest.approx(exact(0.03, 0.05, 0.2), abs=0.1)


def test_density_is_that_of_the_draws() -> None:
    draws = np.random.default_rng(3).gamma(4.0, size=100_000)
    assert log_posterior_density(draws, 3.0) == pytest.approx(stats.gamma.logpdf(3.0, 4.0), abs=0.05)
