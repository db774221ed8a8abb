"""Whiteners: linear, white where the noise is theirs, glitches without weight."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import coloured, white

from bayes_hw.gap.noise.whitener import Autoregression, Plain, bridge, fit_autoregression

NONE = np.zeros(3000, dtype=np.bool_)


def dense_log_likelihood(e: np.ndarray, sigma: float, phi: float) -> float:
    """First-order noise by its full covariance."""
    lags = np.abs(np.subtract.outer(np.arange(len(e)), np.arange(len(e))))
    covariance = sigma**2 * phi**lags
    _, log_determinant = np.linalg.slogdet(covariance)
    return float(-0.5 * (e @ np.linalg.solve(covariance, e) + log_determinant + len(e) * np.log(2 * np.pi)))


def test_plain_divides_by_sigma() -> None:
    np.testing.assert_array_equal(Plain(2.0).whiten(np.ones((4, 2)), 0), np.full((4, 2), 0.5))


def test_first_order_noise_is_found_and_whitened() -> None:
    """Coefficient and sigma; the innovations are white and of unit variance."""
    e = coloured(3000, 0.01, 0.8, seed=2)
    found = fit_autoregression([e], [NONE], 1)
    assert found.coefficients[0] == pytest.approx(0.8, abs=0.04)
    assert found.sigma == pytest.approx(0.01, rel=0.1)
    innovations = found.whiten(e[:, None], 0)[:, 0]
    assert innovations.std() == pytest.approx(1, abs=0.04)
    assert abs(np.corrcoef(innovations[1:], innovations[:-1])[0, 1]) < 0.05
    assert found.parameter_count == 2


def test_its_likelihood_is_that_of_the_dense_gaussian() -> None:
    """To the first sample's normalization, log sigma / sigma_a."""
    e = coloured(400, 1.0, 0.6, seed=3)
    found = fit_autoregression([e], [NONE[:400]], 1)
    expected = dense_log_likelihood(e, found.sigma, float(found.coefficients[0]))
    assert found.log_likelihood == pytest.approx(
        expected + np.log(found.sigma / found.innovation_sigma), abs=1e-6
    )


def test_whitening_is_linear_and_drops_glitches() -> None:
    gaps = np.zeros(50, dtype=np.bool_)
    gaps[[0, 20, 21, 49]] = True
    model = Autoregression(np.array([0.5, 0.2]), 1.0, 1.5, 0.0, [gaps])
    a, b = white(50, 1, 1)[:, None], white(50, 1, 2)[:, None]
    np.testing.assert_allclose(
        model.whiten(2 * a - 3 * b, 0), 2 * model.whiten(a, 0) - 3 * model.whiten(b, 0), atol=1e-12
    )
    assert not model.whiten(a, 0)[gaps].any()
    spoilt = a.copy()
    spoilt[gaps] = 1e6
    np.testing.assert_array_equal(model.whiten(spoilt, 0), model.whiten(a, 0))


def test_samples_are_whitened_by_those_before() -> None:
    """Less their weighed sum; the first ones by sigma."""
    coefficients = np.array([0.5, 0.2, -0.1])
    columns = np.stack([white(40, 1, seed) for seed in range(3)], axis=1)
    found = Autoregression(coefficients, 0.8, 1.5, 0.0, [NONE[:40]]).whiten(columns, 0)
    np.testing.assert_allclose(found[:3], columns[:3] / 1.5)
    for k in range(3, 40):
        np.testing.assert_allclose(found[k], (columns[k] - coefficients @ columns[k - 3 : k][::-1]) / 0.8)


def test_bridges_stand_between_their_neighbours() -> None:
    columns = np.array([[0.0], [9.0], [4.0], [6.0]])
    gaps = np.array([False, True, False, False])
    np.testing.assert_array_equal(bridge(columns, gaps)[:, 0], [0, 2, 4, 6])
    assert bridge(columns, np.zeros(4, dtype=np.bool_)) is columns


def test_samples_masked_by_either_do_not_count() -> None:
    """What was masked stays so; without a mask of its own, only the given one counts."""
    columns = np.ones((6, 2))
    first, second = np.arange(6) < 2, np.arange(6) > 4
    masked = Plain(0.5).without([first])
    np.testing.assert_array_equal(masked.whiten(columns, 0)[:, 0], [0, 0, 2, 2, 2, 2])
    np.testing.assert_array_equal(masked.without([second]).whiten(columns, 0)[:, 1], [0, 0, 2, 2, 2, 0])
