"""The compiled noise filters against brute force."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bayes_hw.gap.noise.noise_kernel import (
    bridged_over,
    held_ages,
    innovations,
    jitter_filter,
    seen_part,
    untimely_variance,
)
from bayes_hw.model.blocks import DeadZone

RNG = np.random.default_rng(1)


@pytest.mark.parametrize("coefficient", [0.0, 0.7])
def test_jitter_filter_is_the_dense_gaussian(coefficient: float) -> None:
    """Whitened columns are those of the Cholesky factor of the full covariance, its log-determinant too."""
    n, variance = 40, 0.3
    extra = RNG.uniform(0, 2, n)
    lags = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    covariance = variance / (1 - coefficient**2) * coefficient**lags + np.diag(extra)
    columns = RNG.normal(size=(n, 3))
    white = np.empty_like(columns)
    log_determinant = jitter_filter(columns, coefficient, variance, extra, white)
    np.testing.assert_allclose(white, np.linalg.solve(np.linalg.cholesky(covariance), columns), atol=1e-10)
    assert log_determinant == pytest.approx(np.linalg.slogdet(covariance)[1], abs=1e-9)


@pytest.mark.parametrize("coefficient", [0.0, 0.6])
def test_held_ages_sum_over_every_history(coefficient: float) -> None:
    """Six samples: likelihood and filtered ages by adding up all 32 histories of fresh and repeated."""
    n, hold, sigma = 6, 0.35, 0.4
    simulated, y = np.cumsum(RNG.normal(size=n)), np.zeros(n)
    y[:] = simulated[[0, 1, 1, 1, 4, 4]] + 0.3 * RNG.normal(size=n)
    weights = np.zeros((n, n))
    totals = np.zeros(n)
    for until in range(n):
        for repeats in itertools.product((False, True), repeat=until):
            age, ages = 0, [0]
            for again in repeats:
                age = age + 1 if again else 0
                ages.append(age)
            noise = np.array([y[k] - simulated[k - ages[k]] for k in range(until + 1)])
            shocks = noise - coefficient * np.concatenate([[0.0], noise[:-1]])
            density = np.prod(np.exp(-0.5 * (shocks / sigma) ** 2) / (sigma * np.sqrt(2 * np.pi)))
            prior = np.prod([hold if again else 1 - hold for again in (False, *repeats)])
            weights[until, ages[-1]] += density * prior
        totals[until] = weights[until].sum()
    found = np.empty((n, n))
    log_likelihood = held_ages(y, simulated, hold, coefficient, sigma, found)
    np.testing.assert_allclose(found, weights / totals[:, None], atol=1e-10)
    assert log_likelihood == pytest.approx(np.log(totals[-1]), abs=1e-9)


@pytest.mark.parametrize("order", [0, 1, 3])
def test_innovations_are_those_of_an_explicit_sum(order: int) -> None:
    """Of every column; the first samples stand alone, over the noise's whole spread."""
    coefficients, columns = RNG.uniform(-0.4, 0.4, order), RNG.normal(size=(12, 2))
    white = innovations(columns, coefficients, 0.5, 2.0)
    np.testing.assert_allclose(white[:order], columns[:order] / 2.0)
    for k in range(order, 12):
        past = sum(c * columns[k - lag] for lag, c in enumerate(coefficients, start=1))
        np.testing.assert_allclose(white[k], (columns[k] - past) / 0.5, atol=1e-14)


def test_bridges_at_the_ends_and_over_long_gaps() -> None:
    """Before the first sample that is kept stands that one, after the last one the middle of the last two."""
    columns = np.array([9.0, 9.0, 2.0, 9.0, 9.0, 6.0, 8.0, 9.0])[:, None]
    gaps = np.array([True, True, False, True, True, False, False, True])
    np.testing.assert_array_equal(bridged_over(columns, gaps)[:, 0], [2, 2, 2, 4, 4, 6, 8, 7])
    lone = bridged_over(columns, np.arange(8) != 5)
    np.testing.assert_array_equal(lone, 6.0)


def test_variance_of_untimely_samples_has_a_floor() -> None:
    speed, bend = np.array([1.0, 1.0, 0.0]), np.array([2.0, -90.0, 5.0])
    np.testing.assert_allclose(untimely_variance(0.1, speed, bend, 0.25), [0.12, 0.025, 0.05])


def test_what_a_dead_zone_shows_of_a_sway_is_what_many_draws_show() -> None:
    """Share by least squares and the mean square of what is missing, in, near and out of the dead zone."""
    half_width, w = 1.0, np.array([0.0, 0.9, -1.2, 4.0])
    sway, variance = np.array([0.1, -0.2, 0.3, 0.2]), np.array([0.3, 0.2, 0.5, 0.4])
    nodes, weights = np.polynomial.hermite_e.hermegauss(60)
    shares, doubts = seen_part(w, sway, variance, half_width, 1e-12, nodes, weights / weights.sum())
    shown = DeadZone(half_width)
    for k in range(4):
        added = sway[k] + np.sqrt(variance[k]) * RNG.normal(size=400_000)
        part = shown(w[k] + added) - shown(w[k])
        share = np.mean(part * added) / np.mean(added**2)
        assert shares[k] == pytest.approx(share, abs=0.01)
        assert doubts[k] == pytest.approx(np.mean((part - share * added) ** 2), abs=0.01)
    shares, doubts = seen_part(w, sway, variance, half_width, 1e9, nodes, weights / weights.sum())
    assert set(shares) <= {0.0, 1.0} and not doubts.any()
