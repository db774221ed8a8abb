"""Posterior draws of an explanation's parameters, by importance sampling and emcee."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from emcee import EnsembleSampler
from emcee.moves import DEMove
from scipy.stats import norm

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.exact_maximum import DisplayDensity, exact_likelihood
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.free_level import without_level
from bayes_hw.gap.fit.hypothesis import Hypothesis, held_within_prior
from bayes_hw.gap.simulate.parallel import Each
from bayes_hw.infer.importance import acceptance_from_weights
from bayes_hw.infer.mixture import StudentTMixture, laplace_proposal, refitted
from bayes_hw.infer.moves import IndependenceMove

PROBABILITY = 0.94

NORMAL_HALF_WIDTH = float(norm.ppf((1 + PROBABILITY) / 2))
"""Half the width of that interval of a normal variable, in its standard deviations."""


WALKERS = 64
BURN_IN = 8
STEPS = 32
INDEPENDENCE_WEIGHT = 0.8

ROUGH_DRAWS = 1024

ROUNDS = 4
DRAWS_A_DIMENSION = 32
ENOUGH = 0.5
"""Expected acceptance of independence proposals at which the proposal is good."""

LEAST_ACCEPTED = 0.05
"""Expected acceptance below which no proposal describes the density: its draws would be a few points."""

EFFECTIVE_A_DIMENSION = 6.0
"""Effective draws a dimension from which a proposal is fitted; fewer, and the weights are tempered."""


@dataclass(frozen=True)
class Draws:
    """Coordinates and values (draws, parameters); the noise (draws,) where it was drawn with them."""

    coordinates: FloatArray
    values: FloatArray
    sigma: FloatArray | None = None


class Density(Protocol):
    """A log-density (points,) of points (points, dimension)."""

    def __call__(self, points: FloatArray) -> FloatArray: ...


class PosteriorDensity:
    """The log-density of an explanation's coordinates, the noise as estimated."""

    def __init__(self, explanation: Explanation) -> None:
        best = explanation.fit
        self.hypothesis: Hypothesis = best.hypothesis
        self.measured, self.whitener = best.measured, best.whitener

    def __call__(self, points: FloatArray) -> FloatArray:
        """Log-density (points,) at coordinates (points, parameters), up to a constant."""
        totals = self.hypothesis.log_prior(points)
        for record, y in enumerate(self.hypothesis.simulate_batch(self.hypothesis.to_values(points))):
            white = self.whitener.whiten(self.measured[record][:, None] - y, record)
            white = without_level(self.hypothesis, self.whitener, white, record)
            totals -= 0.5 * np.sum(white**2, axis=0)
        return np.where(np.isfinite(totals), totals, -np.inf)


@dataclass(frozen=True)
class _Shared:
    """A density whose points are shared among threads."""

    density: Density
    each: Each

    def __call__(self, points: FloatArray) -> FloatArray:
        parts = np.array_split(points, min(self.each.jobs, len(points)))
        return np.concatenate(self.each(self.density, parts))


def posterior_draws(
    explanation: Explanation,
    rng: np.random.Generator,
    rivals: Sequence[FloatArray] = (),
    each: Each | None = None,
) -> Draws:
    """Draws of the posterior of an explanation.

    The noise is that of the explanation, its parameters as estimated; where an encoder repeats or rounds, the
    likelihood is exact and the noise drawn too. A Student t about the best fit is fitted to its own weighted
    draws until independence proposals from it are mostly accepted; then emcee mixes them with differential
    evolution. A chaotic response has no smooth likelihood, nor has one where hardly a proposal is accepted:
    draws are then those of a normal distribution about the best fit that is as wide as the other fits of the
    same effects, at coordinates `rivals`, lie apart.
    At most ROUNDS * DRAWS_A_DIMENSION simulations a dimension and WALKERS * (STEPS + 1) more, of any
    simulator: the same seed gives the same draws on any machine. `each` shares the simulations of a step
    among its threads.
    """
    each = each or Each()
    best = explanation.fit
    to_values = best.hypothesis.to_values
    likelihood = exact_likelihood(explanation)
    if likelihood is None:
        covariance = best.covariance()
        posterior = _Shared(PosteriorDensity(explanation), each)
        sampled = (
            None
            if explanation.cannot_be_predicted
            else _sampled(posterior, best.coordinates, covariance, rng)
        )
        if sampled is None:
            apart = np.array([best.coordinates - rival for rival in rivals]).reshape(-1, len(covariance))
            covariance = covariance + np.diag(np.sum(apart**2, axis=0) / max(len(apart), 1))
            drawn = laplace_proposal(best.coordinates, covariance).sample(ROUGH_DRAWS, rng)
            sampled = held_within_prior(best.hypothesis, drawn, best.coordinates)
        return Draws(sampled, to_values(sampled))
    density = DisplayDensity(best, likelihood)
    mode, covariance = density.mode()
    points = _sampled(_Shared(density, each), mode, covariance, rng)
    if points is None:
        points = laplace_proposal(mode, covariance).sample(ROUGH_DRAWS, rng)
    coordinates = density.coordinates(points)
    response, noise = coordinates[:, : density.count], coordinates[:, density.count :]
    return Draws(response, to_values(response), likelihood.sigma(noise))


def _sampled(
    density: Density, mode: FloatArray, covariance: FloatArray, rng: np.random.Generator
) -> FloatArray | None:
    """Draws (draws, dimension) of `density`, near normal about `mode` (dimension,) with `covariance`; None
    where it is not."""
    proposal = laplace_proposal(mode, covariance)
    seed = int(rng.integers(2**31))
    proposal, start, acceptance = _fitted(proposal, density, rng)
    if acceptance < LEAST_ACCEPTED:
        return None
    moves = [(IndependenceMove(proposal), INDEPENDENCE_WEIGHT), (DEMove(), 1 - INDEPENDENCE_WEIGHT)]
    sampler = EnsembleSampler(WALKERS, start.shape[1], density, moves=moves, vectorize=True)
    sampler.random_state = np.random.RandomState(np.random.MT19937(seed)).get_state()
    sampler.run_mcmc(start, STEPS, skip_initial_state_check=True)
    return np.asarray(sampler.get_chain(discard=BURN_IN, flat=True))


def _fitted(
    proposal: StudentTMixture, density: Density, rng: np.random.Generator
) -> tuple[StudentTMixture, FloatArray, float]:
    """The proposal of a few rounds whose draws would be accepted most, resampled posterior draws, and that
    acceptance."""
    dimension = proposal.dimension
    best, best_acceptance, kept = proposal, -1.0, proposal.sample(WALKERS, rng)
    for number in range(ROUNDS):
        x = proposal.sample(DRAWS_A_DIMENSION * dimension, rng)
        log_weights = density(x) - proposal.log_density(x)
        if not np.isfinite(log_weights.max()):
            break
        weights = np.exp(log_weights - log_weights.max())
        acceptance = acceptance_from_weights(weights, np.full(len(x), 1 / len(x)))
        if acceptance > best_acceptance:
            best, best_acceptance = proposal, acceptance
            kept = x[rng.choice(len(x), WALKERS, p=weights / weights.sum())]
        if acceptance > ENOUGH:
            break
        shares = _tempered(log_weights, EFFECTIVE_A_DIMENSION * dimension)
        proposal = refitted(proposal, x, shares, bent=number > 0)
    return best, kept, best_acceptance


def _tempered(log_weights: FloatArray, least: float) -> FloatArray:
    """Weights of sum one, to the largest power at most one that leaves `least` effective draws."""
    low, high = 0.0, 1.0
    if _effective(log_weights) >= least:
        low = 1.0
    else:
        for _ in range(30):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if _effective(middle * log_weights) >= least else (low, middle)
    weights = np.exp(low * (log_weights - log_weights.max()))
    return np.asarray(weights / weights.sum())


def _effective(log_weights: FloatArray) -> float:
    weights = np.exp(log_weights - log_weights.max())
    return float(weights.sum() ** 2 / np.sum(weights**2))
