"""Every move leaves its target as it is: one harness, and proof that it catches a wrong acceptance factor."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
from emcee.moves import Move
from scipy import stats
from targets import Gaussian, LogGamma, Ridges, Target

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.convergence import autocorrelation_time
from bayes_hw.infer.ensemble import EnsembleState, advance, start_ensemble
from bayes_hw.infer.mixture import StudentTMixture, fit_student_t_mixture, laplace_proposal, refitted
from bayes_hw.infer.moves import DifferentialEvolutionMove, IndependenceMove, OppositeMove, weighted_moves

WALKERS, BURN_IN, STEPS = 192, 200, 700
Moves = Sequence[tuple[Move, float]]
MoveMaker = Callable[[StudentTMixture, StudentTMixture], Moves]

MOVES: dict[str, MoveMaker] = {
    "independence, Laplace": lambda laplace, _: [(IndependenceMove(laplace), 1.0)],
    "independence, mixture": lambda _, mixture: [(IndependenceMove(mixture), 1.0)],
    "opposite, Laplace": lambda laplace, _: [(OppositeMove(laplace), 1.0)],
    "opposite, mixture": lambda _, mixture: [(OppositeMove(mixture), 1.0)],
    "opposite, independent and local": lambda laplace, _: weighted_moves(laplace, 0.9, opposite=True),
    "even mix": lambda laplace, _: weighted_moves(laplace, 0.5),
    "mostly differential evolution": lambda _, mixture: weighted_moves(mixture, 0.1),
    "differential evolution alone": lambda laplace, _: weighted_moves(laplace, 0.5)[2:],
}

GAUSSIAN = ("independence, mixture", "opposite, independent and local")
SKEWED = ("opposite, mixture", "differential evolution alone")
"""Every kind of move and of proposal once; the other pairs of move and target are run by `make slow-test`."""


def each_move(fast: tuple[str, ...]) -> list[Any]:
    return [name if name in fast else pytest.param(name, marks=pytest.mark.slow) for name in MOVES]


def proposals(points: FloatArray) -> tuple[StudentTMixture, StudentTMixture]:
    """A Laplace-like proposal off the centre and a fitted mixture, from exact draws."""
    covariance = np.cov(points.T)
    off_centre = points.mean(axis=0) + 0.3 * np.sqrt(np.diag(covariance))
    mixture = fit_student_t_mixture(points[:2000], 3, np.random.default_rng(1))
    return laplace_proposal(off_centre, covariance, 1.3), mixture


def run(target: Target, start: FloatArray, moves: Moves) -> FloatArray:
    """A chain (STEPS, WALKERS, dimension) after BURN_IN steps."""
    state = start_ensemble(start, target, seed=7)
    _, _, _, state = advance(state, target, moves, BURN_IN)
    chain, _, _, _ = advance(state, target, moves, STEPS)
    return chain


def assert_mean(series: FloatArray, expected: float, tau: float | None = None) -> None:
    """The mean of series (steps, walkers) within four Monte Carlo standard errors of `expected`, by an
    autocorrelation time of `tau` steps where that is known."""
    error = series.std() * np.sqrt((tau or autocorrelation_time(series)) / series.size)
    assert abs(series.mean() - expected) < 4 * error, (
        f"{series.mean():.4f} +- {error:.4f}, not {expected:.4f}"
    )


def assert_moments(
    series: FloatArray,
    mean: float,
    variance: float,
    distribution_function: Callable[[FloatArray], FloatArray],
) -> None:
    """Mean, variance about the true mean, and Kolmogorov-Smirnov on nearly independent draws."""
    tau = autocorrelation_time(series)
    assert_mean(series, mean, tau)
    assert_mean((series - mean) ** 2, variance)
    thin = int(np.ceil(3 * tau))
    assert stats.kstest(series[::thin].ravel(), distribution_function).pvalue > 1e-4


def assert_leaves_gaussian(make: MoveMaker) -> None:
    target = Gaussian(16)
    points = target.draw(4000, np.random.default_rng(2))
    chain = run(target, points[:WALKERS], make(*proposals(points)))
    assert_mean(target.chi_square(chain) / 16, 1.0)
    for i in range(16):
        sd = np.sqrt(target.covariance[i, i])
        assert_moments(chain[..., i], target.mean[i], sd**2, stats.norm(target.mean[i], sd).cdf)


def assert_leaves_log_gamma(make: MoveMaker) -> None:
    target = LogGamma(3)
    points = target.draw(4000, np.random.default_rng(3))
    chain = run(target, points[:WALKERS], make(*proposals(points)))
    exact = stats.loggamma(target.SHAPE)
    for i in range(3):
        assert_moments(chain[..., i], exact.mean(), exact.var(), exact.cdf)


@pytest.mark.parametrize("name", each_move(GAUSSIAN))
def test_move_leaves_a_correlated_gaussian(name: str) -> None:
    """16 dimensions: mean chi^2 per dimension, every mean and variance, every marginal."""
    assert_leaves_gaussian(MOVES[name])


@pytest.mark.parametrize("name", each_move(SKEWED))
def test_move_leaves_a_skewed_target(name: str) -> None:
    assert_leaves_log_gamma(MOVES[name])


def bent(points: FloatArray) -> StudentTMixture:
    flat = laplace_proposal(np.zeros(points.shape[1]), np.eye(points.shape[1]))
    return refitted(flat, points, np.full(len(points), 1 / len(points)), bent=True)


@pytest.mark.slow
@pytest.mark.parametrize("weight", [0.0, 0.5])
def test_moves_along_a_bend_leave_curved_ridges(weight: float) -> None:
    """Eight dimensions, four ridges: mean and variance of every straight variable and its marginal, from
    differential evolution in straight coordinates, alone and beside bent independence proposals."""
    target, rng = Ridges(8), np.random.default_rng(6)
    points = target.draw(6000, rng)
    chain = run(target, points[:WALKERS], weighted_moves(bent(points), weight, opposite=True))
    straight = target.straight(chain)
    for i in range(8):
        assert_moments(straight[..., i], 0.0, 1.0, stats.norm.cdf)


def test_along_a_bend_more_steps_are_taken() -> None:
    """Differential evolution in straight coordinates is accepted half as often again as across the ridges."""
    target, rng = Ridges(16), np.random.default_rng(7)
    points = target.draw(6000, rng)
    state = start_ensemble(points[:WALKERS], target, seed=8)
    accepted = [
        float(np.mean(advance(state, target, [(DifferentialEvolutionMove(bend=bend), 1.0)], 100)[2]))
        for bend in (None, bent(points).bend)
    ]
    assert accepted[1] > 1.5 * accepted[0]


class WrongFactor(IndependenceMove):
    """An independence move whose acceptance factor is multiplied by `power`; 1 is right."""

    def __init__(self, proposal: StudentTMixture, power: float) -> None:
        super().__init__(proposal)
        self.power = power

    def _propose(self, x: FloatArray, random: np.random.RandomState) -> tuple[FloatArray, FloatArray]:
        proposed, factor = super()._propose(x, random)
        return proposed, self.power * factor


@pytest.mark.parametrize("power", [pytest.param(0.0, marks=pytest.mark.slow), 0.9])
@pytest.mark.parametrize(
    "check", [pytest.param(assert_leaves_gaussian, marks=pytest.mark.slow), assert_leaves_log_gamma]
)
def test_harness_catches_a_wrong_factor(power: float, check: Callable[[MoveMaker], None]) -> None:
    """Ten per cent off in the logarithm of the factor is enough, in either target."""
    with pytest.raises(AssertionError):
        check(lambda laplace, _: [(WrongFactor(laplace, power), 1.0)])


def test_factor_is_the_ratio_of_proposal_densities() -> None:
    """q(x) / q(x'), the Hastings factor of an independence proposal; opposite for the reverse step."""
    proposal = laplace_proposal(np.array([1.0, -1.0]), np.array([[2.0, 0.3], [0.3, 1.0]]))
    x = np.random.default_rng(4).normal(size=(5, 2))
    proposed, factor = IndependenceMove(proposal)._propose(x, np.random.RandomState(1))
    exact = stats.multivariate_t([1.0, -1.0], [[2.0, 0.3], [0.3, 1.0]], df=8)
    np.testing.assert_allclose(factor, exact.logpdf(x) - exact.logpdf(proposed), rtol=1e-10)


def test_weights_add_to_one() -> None:
    proposal = laplace_proposal(np.zeros(2), np.eye(2))
    for share in (0.1, 0.5, 0.9):
        moves = weighted_moves(proposal, share)
        assert sum(weight for _, weight in moves) == pytest.approx(1)
        assert moves[0][1] == share
        both = weighted_moves(proposal, share, opposite=True)
        assert both[0][1] + both[1][1] == pytest.approx(share)
        assert [weight for _, weight in both[2:]] == [weight for _, weight in moves[2:]]
        assert moves[1][1] == 0


def test_advancing_in_two_parts_is_advancing_at_once() -> None:
    """The state carries everything, the generator included: the numbers are the same to the bit."""
    target = Gaussian(3)
    rng = np.random.default_rng(5)
    moves = weighted_moves(laplace_proposal(target.mean, target.covariance), 0.5)
    state: EnsembleState = start_ensemble(target.draw(16, rng), target, seed=1)
    whole, log_whole, _, _ = advance(state, target, moves, 12)
    first, log_first, _, middle = advance(state, target, moves, 5)
    second, log_second, _, _ = advance(middle, target, moves, 7)
    np.testing.assert_array_equal(whole, np.concatenate([first, second]))
    np.testing.assert_array_equal(log_whole, np.concatenate([log_first, log_second]))
    np.testing.assert_array_equal(target(whole[-1]), log_whole[-1])
