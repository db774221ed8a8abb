"""The compiled noise filters against brute force."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from bayes_hw.gap.noise_kernel import held_ages, jitter_filter

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
