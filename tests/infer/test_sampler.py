"""The sampler finds known distributions, repeats itself, and says when it has not converged."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from targets import Banana, Gaussian, HalfSpace, Ridges, Target, TwoModes

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.infer.convergence import autocorrelation_time
from bayes_hw.infer.sampler import SamplerSettings, Sampling, sample

QUICK = SamplerSettings(ensembles=4, walkers=64, max_steps=1500, target_ess=3000)


def run(
    make: Callable[[], Target],
    mode: FloatArray,
    covariance: FloatArray,
    *,
    seed: int = 1,
    settings: SamplerSettings = QUICK,
    jobs: int = 1,
) -> Sampling:
    return sample(make, mode, covariance, np.random.default_rng(seed), settings=settings, jobs=jobs)


def assert_mean(series: FloatArray, expected: float) -> None:
    """The mean of series (ensembles, steps, walkers) within four Monte Carlo standard errors."""
    size = sum(part.size / autocorrelation_time(part) for part in series)
    error = series.std() / np.sqrt(size)
    assert abs(series.mean() - expected) < 4 * error, (
        f"{series.mean():.4f} +- {error:.4f}, not {expected:.4f}"
    )


def test_gaussian_in_eight_dimensions() -> None:
    """Moments and mean chi^2, started from a mode half a width off and a covariance 1.5 times too wide."""
    target = Gaussian(8)
    mode = target.mean + 0.5 * np.sqrt(np.diag(target.covariance))
    found = run(lambda: Gaussian(8), mode, 1.5 * target.covariance)
    assert found.convergence.converged
    assert_mean(target.chi_square(found.chain) / 8, 1.0)
    for i in range(8):
        assert_mean(found.chain[..., i], target.mean[i])
        assert_mean((found.chain[..., i] - target.mean[i]) ** 2, target.covariance[i, i])
    np.testing.assert_allclose(found.log_probability, -0.5 * target.chi_square(found.chain), rtol=1e-9)


@pytest.mark.slow
def test_banana() -> None:
    """A curved ridge, from the Laplace approximation at its bend: no approximation of its arms. The chain is
    long, since the moments of its far arms, not the stopping rule, are what is tested."""
    settings = SamplerSettings(walkers=64, max_steps=1500, target_ess=1e6)
    found = run(Banana, np.zeros(2), np.diag([1.0, 0.25]), settings=settings)
    assert found.convergence.converged
    x, y = found.chain[..., 0], found.chain[..., 1]
    assert_mean(x, 0.0)
    assert_mean(x**2, 1.0)
    assert_mean(y, 1.0)
    assert_mean((y - 1) ** 2, 2.25)
    assert_mean((y - x**2) ** 2, 0.25)


def test_eight_curved_ridges_at_once() -> None:
    """Sixteen parameters, from the Laplace approximation where all ridges bend: most proposals of the bent
    density are accepted, and the law of the straight variables is the exact one."""
    target = Ridges(16)
    widths = np.repeat([1.0, 0.25], 8)
    found = run(lambda: Ridges(16), np.zeros(16), (target.mixing * widths) @ target.mixing.T)
    assert found.convergence.converged
    assert found.acceptance.mean() > 0.4
    straight = target.straight(found.chain)
    for i in range(16):
        assert_mean(straight[..., i], 0.0)
        assert_mean(straight[..., i] ** 2, 1.0)
    assert_mean(straight[..., 8] * straight[..., 0], 0.0)


def test_two_modes_get_their_weights() -> None:
    """Started at one mode alone with its own width, the other is found and weighed."""
    found = run(TwoModes, np.array([3.0, 0, 0, 0]), np.eye(4))
    assert found.convergence.converged
    left = found.chain[..., 0] < 0
    exact = 0.3 * 0.99865 + 0.7 * 0.00135
    assert_mean(left.astype(np.float64), exact)
    assert_mean(found.chain[..., 0], 0.4 * 3)
    assert_mean(found.chain[..., 1] ** 2, 1.0)


def test_impossible_regions_are_never_entered() -> None:
    target = HalfSpace(3)
    found = run(lambda: HalfSpace(3), target.mean, target.covariance)
    assert found.convergence.converged
    assert found.chain[..., 0].min() > target.mean[0]
    assert np.isfinite(found.log_probability).all()
    assert_mean(found.chain[..., 0] - target.mean[0], np.sqrt(2 * target.covariance[0, 0] / np.pi))


def test_no_possible_start_is_an_error_not_a_hang() -> None:
    class Nowhere(Gaussian):
        def log_density(self, x: FloatArray) -> FloatArray:
            return np.full(len(x), -np.inf)

    with pytest.raises(InputError, match="no parameters near"):
        run(lambda: Nowhere(2), np.zeros(2), np.eye(2))


@pytest.mark.slow
def test_same_seed_same_numbers_whatever_the_jobs() -> None:
    target = Gaussian(4)
    short = SamplerSettings(ensembles=3, walkers=32, max_steps=100, target_ess=1e9)
    first, again, threaded, other = (
        run(lambda: Gaussian(4), target.mean, target.covariance, seed=seed, settings=short, jobs=jobs)
        for seed, jobs in ((1, 1), (1, 1), (1, 2), (2, 1))
    )
    np.testing.assert_array_equal(first.chain, again.chain)
    np.testing.assert_array_equal(first.chain, threaded.chain)
    assert not np.array_equal(first.chain, other.chain)
    assert first.chain.shape == (3, 100, 32, 4)
    assert first.acceptance.shape == (3,)


def test_ensembles_are_independent_of_each_other() -> None:
    target = Gaussian(4)
    short = SamplerSettings(ensembles=4, walkers=32, max_steps=50, target_ess=1e9)
    chain = run(lambda: Gaussian(4), target.mean, target.covariance, settings=short).chain
    for i in range(1, 4):
        assert not np.isin(chain[0, -1, :, 0], chain[i, -1, :, 0]).any()


def test_running_out_of_steps_is_said() -> None:
    """A ten-dimensional banana in 50 steps of 32 walkers: not converged, and the reasons in words."""

    class Ridge(Target):
        def log_density(self, x: FloatArray) -> FloatArray:
            return -0.5 * np.sum(((x[:, 1:] - x[:, :-1] ** 2) / 0.1) ** 2, axis=1) - 0.5 * x[:, 0] ** 2

    settings = SamplerSettings(ensembles=4, walkers=32, max_steps=50)
    found = run(lambda: Ridge(10), np.zeros(10), 0.1 * np.eye(10), settings=settings)
    assert found.chain.shape[1] == 50
    assert not found.convergence.converged
    assert any("x" in problem for problem in found.convergence.problems)


def test_it_stops_once_enough_is_known() -> None:
    target = Gaussian(2)
    settings = SamplerSettings(walkers=64, target_ess=2000, max_steps=5000)
    found = run(lambda: Gaussian(2), target.mean, target.covariance, settings=settings)
    assert found.convergence.ess_bulk.min() >= 2000 and found.convergence.ess_tail.min() >= 2000
    assert found.chain.shape[1] <= 200


def test_non_finite_evaluations_of_the_run_are_counted() -> None:
    class Counting(Gaussian):
        def log_density(self, x: FloatArray) -> FloatArray:
            self.non_finite += 1
            return super().log_density(x)

    target = Gaussian(2)
    settings = SamplerSettings(ensembles=2, walkers=16, max_steps=50, target_ess=1e9)
    found = run(lambda: Counting(2), target.mean, target.covariance, settings=settings)
    assert 100 <= found.non_finite <= 200


def test_walkers_fill_lanes_and_exceed_twice_the_dimension() -> None:
    for dimension in (2, 12, 40, 200):
        walkers = SamplerSettings().walkers_for(dimension)
        assert walkers % 64 == 0 and walkers > 2 * dimension
    assert SamplerSettings(walkers=50).walkers_for(10) == 50
