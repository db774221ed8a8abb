"""Geweke's joint-distribution test of the moves (doi 10.1198/016214504000001132).

Parameters and data are drawn together in two ways: parameters from the priors and data given them
(marginal-conditional), and a chain that alternates one step of the moves given the data with new data given
the parameters (successive-conditional). If moves, likelihood, priors and Jacobians are right, all moments
agree. Every walker has data of its own: an ensemble move also leaves a product of unequal densities as it is.
"""

from __future__ import annotations

import numpy as np
import pytest
from emcee.moves import DEMove, Move

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.convergence import autocorrelation_time
from bayes_hw.infer.ensemble import EnsembleState, advance, start_ensemble
from bayes_hw.infer.mixture import StudentTMixture, laplace_proposal
from bayes_hw.infer.moves import IndependenceMove, weighted_moves
from bayes_hw.infer.noise import log_likelihood
from bayes_hw.model.kernel import LaggedSums
from bayes_hw.model.parameters import Parameter, as_coordinates, as_values, log_prior
from bayes_hw.model.priors import HyperbolicTangent, Identity, Logarithm, LogNormal, Normal, Uniform

WALKERS, SAMPLES, CYCLES = 400, 12, 600
LIMIT = 4.5
"""Of the largest |z| of all moments: fifteen normal ones exceed it with probability 1e-4."""

PARAMETERS = (
    Parameter("mean", "", 0.0, Normal(0.5, 1.0), Identity()),
    Parameter("noise.sigma", "", 1.0, LogNormal(1.0, 0.5), Logarithm()),
    Parameter("noise.partial_autocorrelation1", "", 0.0, Uniform(-0.9, 0.9), HyperbolicTangent()),
)


class OwnData:
    """Log-posterior of mean, sigma and AR(1) coefficient of every walker given its own data.

    Called with all walkers, or with the even ones and the odd ones in turn, as emcee's moves do when their
    halves are not shuffled.
    """

    names = tuple(parameter.name for parameter in PARAMETERS)

    def __init__(self, data: FloatArray) -> None:
        self.data = data
        self.non_finite = 0
        self._odd = False

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        if len(coordinates) == WALKERS:
            data = self.data
        else:
            data = self.data[int(self._odd) :: 2]
            self._odd = not self._odd
        values = as_values(PARAMETERS, coordinates.T)
        residual = (data - values[0][:, None]).T
        sums = LaggedSums(
            np.stack([np.sum(residual**2, axis=0), np.sum(residual[1:] * residual[:-1], axis=0)]),
            residual[:1],
            residual[-1:],
        )
        log_density = log_prior(PARAMETERS, coordinates.T)
        return log_density + log_likelihood(sums, SAMPLES, values[1], values[2:])


def draw_parameters(rng: np.random.Generator, count: int) -> FloatArray:
    """Coordinates (count, parameters) from the priors."""
    values = np.stack([p.prior.quantile(rng.random(count)) for p in PARAMETERS])
    return as_coordinates(PARAMETERS, values).T


def draw_data(coordinates: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Data (walkers, SAMPLES) of every walker."""
    mean, sigma, correlation = as_values(PARAMETERS, coordinates.T)
    noise = sigma[:, None] * rng.standard_normal((len(mean), SAMPLES))
    for k in range(1, SAMPLES):
        noise[:, k] = correlation * noise[:, k - 1] + np.sqrt(1 - correlation**2) * noise[:, k]
    return mean[:, None] + noise


def moments(coordinates: FloatArray, data: FloatArray) -> FloatArray:
    """First and second moments of the coordinates, and of them with the data: (walkers, moments)."""
    first = [*coordinates.T]
    second = [a * b for i, a in enumerate(coordinates.T) for b in coordinates.T[: i + 1]]
    centred = data - data.mean(axis=1, keepdims=True)
    statistics = [
        data.mean(axis=1),
        np.log(np.sum(centred**2, axis=1)),
        np.sum(centred[:, 1:] * centred[:, :-1], axis=1) / np.sum(centred**2, axis=1),
    ]
    crossed = [a * b for a, b in zip(coordinates.T, statistics, strict=True)]
    return np.stack([*first, *second, *statistics, *crossed], axis=1)


def z_scores(moves: list[tuple[Move, float]]) -> FloatArray:
    """(successive-conditional - marginal-conditional) / its standard error, of every moment."""
    rng = np.random.default_rng(11)
    independent = draw_parameters(rng, 200_000)
    expected = moments(independent, draw_data(independent, rng))
    start = draw_parameters(rng, WALKERS)
    density = OwnData(draw_data(start, rng))
    state = start_ensemble(start, density, seed=3)
    rows = []
    for _ in range(CYCLES):
        _, _, _, state = advance(state, density, moves, 1)
        density.data = draw_data(state.coordinates, rng)
        state = EnsembleState(state.coordinates, density(state.coordinates), state.random_state)
        rows.append(moments(state.coordinates, density.data))
    chain = np.stack(rows)
    times = np.array([autocorrelation_time(chain[..., i]) for i in range(chain.shape[-1])])
    variance = chain.var(axis=(0, 1)) * np.maximum(times, 1) / (CYCLES * WALKERS)
    variance += expected.var(axis=0) / len(expected)
    return (chain.mean(axis=(0, 1)) - expected.mean(axis=0)) / np.sqrt(variance)


def proposal() -> StudentTMixture:
    """A wide one, off the centre of the priors."""
    points = draw_parameters(np.random.default_rng(5), 4000)
    return laplace_proposal(points.mean(axis=0) + 0.3, np.cov(points.T), 1.0)


def in_fixed_halves(moves: list[tuple[Move, float]]) -> list[tuple[Move, float]]:
    for move, _ in moves:
        move.randomize_split = False
    return moves


class ForgottenFactor(IndependenceMove):
    """An independence move without the ratio of proposal densities."""

    def _propose(self, x: FloatArray, random: np.random.RandomState) -> tuple[FloatArray, FloatArray]:
        proposed, _ = super()._propose(x, random)
        return proposed, np.zeros(len(x))


class WrongDifferentialEvolution(DEMove):  # type: ignore[misc]
    """Its acceptance factor favours proposals farther from zero in the first coordinate."""

    def get_proposal(
        self, s: FloatArray, c: list[FloatArray], random: np.random.RandomState
    ) -> tuple[FloatArray, FloatArray]:
        proposed, factor = super().get_proposal(s, c, random)
        return proposed, factor + 1.0 * (np.abs(proposed[:, 0]) - np.abs(s[:, 0]))


@pytest.mark.parametrize(
    "independence_weight",
    [pytest.param(0.9, marks=pytest.mark.slow), 0.5, pytest.param(0.1, marks=pytest.mark.slow)],
)
def test_moves_leave_the_joint_distribution(independence_weight: float) -> None:
    z = z_scores(in_fixed_halves(weighted_moves(proposal(), independence_weight, opposite=True)))
    assert np.max(np.abs(z)) < LIMIT, z


@pytest.mark.slow
@pytest.mark.parametrize("wrong", [ForgottenFactor(proposal()), WrongDifferentialEvolution()])
def test_a_wrong_factor_is_caught(wrong: Move) -> None:
    z = z_scores(in_fixed_halves([(wrong, 1.0)]))
    assert np.max(np.abs(z)) > 2 * LIMIT, z
