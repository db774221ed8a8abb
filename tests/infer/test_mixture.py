"""The t mixture is the density that it says, draws from it, and finds what made a cloud of points."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate, stats

from bayes_hw.infer.mixture import (
    StudentTMixture,
    fit_student_t_mixture,
    laplace_proposal,
    refitted,
    several_laplace,
)

MEANS = np.array([[0.0, 1.0], [3.0, -2.0]])
SCALES = np.array([[[1.0, 0.3], [0.3, 0.5]], [[0.4, -0.1], [-0.1, 0.9]]])


def mixture(weights: tuple[float, float] = (0.3, 0.7), degrees: float = 8.0) -> StudentTMixture:
    return StudentTMixture(np.array(weights), MEANS, np.linalg.cholesky(SCALES), degrees)


def test_density_is_that_of_scipy() -> None:
    x = np.random.default_rng(1).normal(0, 4, size=(50, 2))
    expected = sum(
        weight * stats.multivariate_t(mean, scale, df=8).pdf(x)
        for weight, mean, scale in zip((0.3, 0.7), MEANS, SCALES, strict=True)
    )
    np.testing.assert_allclose(np.exp(mixture().log_density(x)), expected, rtol=1e-11)


def test_density_integrates_to_one() -> None:
    one = laplace_proposal(np.array([0.4]), np.array([[2.0]]))
    total, _ = integrate.quad(lambda x: np.exp(one.log_density(np.array([[x]]))[0]), -np.inf, np.inf)
    assert total == pytest.approx(1, abs=1e-8)


def test_far_away_points_have_a_finite_density() -> None:
    assert np.isfinite(mixture().log_density(np.full((1, 2), 1e8))).all()


@pytest.mark.parametrize("random", [np.random.default_rng(2), np.random.RandomState(2)])
def test_draws_have_the_moments_of_the_mixture(random: np.random.Generator | np.random.RandomState) -> None:
    """Mean and covariance (t: scale x nu / (nu - 2)) within five standard errors, for both generators."""
    draws = mixture().sample(100_000, random)
    weights = np.array([0.3, 0.7])
    mean = weights @ MEANS
    within = np.einsum("j,jkl->kl", weights, SCALES) * 8 / 6
    spread = np.einsum("j,jk,jl->kl", weights, MEANS - mean, MEANS - mean)
    np.testing.assert_allclose(draws.mean(axis=0), mean, atol=5 * np.sqrt(3.0 / 1e5))
    np.testing.assert_allclose(np.cov(draws.T), within + spread, rtol=0.03, atol=0.02)


def test_draws_follow_the_density() -> None:
    """Kolmogorov-Smirnov of one component's Mahalanobis distance: d^2 / dimension is F(dimension, nu)."""
    one = StudentTMixture(np.ones(1), MEANS[:1], np.linalg.cholesky(SCALES[:1]))
    draws = one.sample(20_000, np.random.default_rng(3)) - MEANS[0]
    distance = np.einsum("ni,ij,nj->n", draws, np.linalg.inv(SCALES[0]), draws)
    assert stats.kstest(distance / 2, stats.f(2, 8).cdf).pvalue > 1e-3


def test_laplace_proposal_has_the_inflated_covariance_as_scale() -> None:
    proposal = laplace_proposal(MEANS[0], SCALES[0], inflation=4.0)
    np.testing.assert_allclose(proposal.factors[0] @ proposal.factors[0].T, 4 * SCALES[0], rtol=1e-12)


def test_expectation_maximisation_recovers_a_mixture() -> None:
    """Weights, means and scales of two t components from 20,000 of their draws."""
    rng = np.random.default_rng(4)
    found = fit_student_t_mixture(mixture().sample(20_000, rng), 2, rng)
    order = np.argsort(found.means[:, 0])
    np.testing.assert_allclose(found.weights[order], [0.3, 0.7], atol=0.02)
    np.testing.assert_allclose(found.means[order], MEANS, atol=0.05)
    scales = found.factors[order] @ np.swapaxes(found.factors[order], 1, 2)
    np.testing.assert_allclose(scales, SCALES, atol=0.06)


def test_expectation_maximisation_covers_both_modes() -> None:
    """Two far clouds of unequal size: an independence sampler needs mass on each."""
    rng = np.random.default_rng(5)
    points = np.concatenate([rng.normal(-10, 1, (1800, 3)), rng.normal(10, 1, (200, 3))])
    found = fit_student_t_mixture(points, 4, rng)
    left = found.means[:, 0] < 0
    assert found.weights[left].sum() == pytest.approx(0.9, abs=0.02)
    assert found.log_density(np.array([[10.0, 10.0, 10.0]]))[0] > -6


def test_more_components_than_the_points_need_do_no_harm() -> None:
    """Four components on one Gaussian cloud in 6 dimensions: a proper density close to the cloud's."""
    rng = np.random.default_rng(6)
    widths = np.logspace(-3, 3, 6)
    points = rng.standard_normal((3000, 6)) * widths
    found = fit_student_t_mixture(points, 4, rng)
    exact = stats.norm(0, widths).logpdf(points).sum(axis=1)
    assert np.mean(exact - found.log_density(points)) < 0.3
    assert found.weights.sum() == pytest.approx(1)


def test_identical_points_give_a_proper_density() -> None:
    """A chain that never moved must not end in a singular matrix."""
    found = fit_student_t_mixture(np.ones((50, 2)), 1, np.random.default_rng(7))
    assert np.isfinite(found.factors).all() and (np.linalg.det(found.factors) > 0).all()


def test_bent_density_is_that_of_its_draws() -> None:
    """Integrates to one on a grid, and its mean over a box is the share of draws there."""
    rng = np.random.default_rng(10)
    x0 = rng.standard_normal(4000)
    points = np.column_stack([x0, x0**2 + 0.5 * rng.standard_normal(4000)])
    start = laplace_proposal(np.zeros(2), np.eye(2))
    bent = refitted(start, points, np.full(4000, 1 / 4000), bent=True)
    x, y = np.linspace(-8, 8, 400), np.linspace(-15, 30, 900)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    density = np.exp(bent.log_density(grid)).reshape(400, 900) * (x[1] - x[0]) * (y[1] - y[0])
    assert density.sum() == pytest.approx(1, abs=0.01)
    draws = bent.sample(40_000, rng)
    inside = (np.abs(draws[:, 0]) < 1) & (draws[:, 1] < 1)
    expected = density[np.abs(x) < 1][:, y < 1].sum()
    assert inside.mean() == pytest.approx(expected, abs=0.02)


def test_components_move_to_the_points_nearest_to_them() -> None:
    rng = np.random.default_rng(11)
    points = np.concatenate([rng.normal(-10, 1, (1800, 3)), rng.normal(10, 2, (200, 3))])
    start = several_laplace([(np.full(3, 9.0), np.eye(3)), (np.full(3, -9.0), np.eye(3))])
    found = refitted(start, points, np.full(2000, 1 / 2000), bent=False)
    np.testing.assert_allclose(found.weights, [0.9, 0.1], atol=0.01)
    np.testing.assert_allclose(found.means[:, 0], [-10, 10], atol=0.5)


def test_a_component_of_fewer_points_than_a_covariance_takes_stays() -> None:
    """Two heavy points in four dimensions have no covariance, though they hold a fifth of the weight."""
    rng = np.random.default_rng(4)
    start = several_laplace([(np.zeros(4), np.eye(4)), (np.full(4, 40.0), np.eye(4))])
    points = np.concatenate([rng.standard_normal((2000, 4)), 40 + rng.standard_normal((2, 4))])
    weights = np.concatenate([np.full(2000, 0.8 / 2000), np.full(2, 0.1)])
    found = refitted(start, points, weights, bent=False)
    np.testing.assert_array_equal(found.means[1], start.means[1])
    np.testing.assert_array_equal(found.factors[1], start.factors[1])
    assert np.isfinite(found.log_density(points)).all()


@pytest.mark.parametrize("correlation", [-0.9, -0.5, 0.0, 0.7])
def test_opposite_draws_are_in_detailed_balance(correlation: float) -> None:
    """From draws of the mixture: the same moments again, the pair's mixed moments symmetric, a correlation of
    the sign asked for within a component; and the log-density at the start is the mixture's."""
    start = mixture(degrees=16.0)
    x = start.sample(200_000, np.random.default_rng(12))
    y, log_density = start.opposite(x, correlation, np.random.RandomState(13))
    np.testing.assert_allclose(log_density, start.log_density(x), rtol=1e-12)
    for power in (1, 2, 3):
        difference = x**power - y**power
        error = difference.std(axis=0) / np.sqrt(len(x))
        assert np.all(np.abs(difference.mean(axis=0)) < 4.5 * error)
    mixed = x[:, :1] ** 2 * y - y[:, :1] ** 2 * x
    assert np.all(np.abs(mixed.mean(axis=0)) < 4.5 * mixed.std(axis=0) / np.sqrt(len(x)))
    left = (x[:, 0] < 0) & (y[:, 0] < 0.5)
    inside = np.corrcoef(x[left, 1], y[left, 1])[0, 1]
    assert np.sign(correlation) == np.sign(inside) if correlation else abs(inside) < 0.05


def test_opposite_draws_follow_a_bend() -> None:
    """From draws of a banana to draws of the same banana: what is left of x1 - x0^2 is as narrow."""
    rng = np.random.default_rng(14)
    x0 = rng.standard_normal(4000)
    points = np.column_stack([x0, x0**2 + 0.2 * rng.standard_normal(4000)])
    bent = refitted(laplace_proposal(np.zeros(2), np.eye(2)), points, np.full(4000, 1 / 4000), bent=True)
    x = bent.sample(50_000, rng)
    y, _ = bent.opposite(x, -0.8, np.random.RandomState(15))
    np.testing.assert_allclose(
        np.quantile(y, [0.1, 0.5, 0.9], axis=0), np.quantile(x, [0.1, 0.5, 0.9], axis=0), atol=0.05
    )
    beside, from_which = (np.abs(points[:, 1] - points[:, 0] ** 2) for points in (y, x))
    assert np.quantile(from_which, 0.8) < 0.4
    assert np.quantile(beside, 0.8) == pytest.approx(np.quantile(from_which, 0.8), rel=0.05)


def test_other_tails_keep_means_and_widen_scales() -> None:
    lighter = mixture().with_tails(200.0, 0.9)
    np.testing.assert_array_equal(lighter.means, MEANS)
    np.testing.assert_allclose(lighter.factors @ np.swapaxes(lighter.factors, 1, 2), 0.9 * SCALES)
    assert lighter.log_density(np.full((1, 2), 50.0)) < mixture().log_density(np.full((1, 2), 50.0))
