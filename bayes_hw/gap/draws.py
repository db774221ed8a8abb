"""Posterior draws of an explanation's parameters, by emcee about its Laplace approximation."""

from __future__ import annotations

import time

import numpy as np
from emcee import EnsembleSampler
from emcee.moves import DEMove

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.explanation import Explanation, ShownHypothesis
from bayes_hw.gap.hypothesis import Hypothesis
from bayes_hw.infer.mixture import StudentTMixture
from bayes_hw.infer.moves import IndependenceMove

WALKERS = 64
BURN_IN = 4
MAX_STEPS = 16
INDEPENDENCE_WEIGHT = 0.8


def posterior_draws(
    explanation: Explanation, rng: np.random.Generator, seconds: float
) -> tuple[FloatArray, FloatArray]:
    """Coordinates (draws, parameters) and values likewise, within about `seconds`.

    The noise is that of the explanation, its parameters as estimated. Independence proposals from a Student t
    about the best fit are mixed with differential evolution; with no time left for the sampler the proposals
    themselves are kept.
    """
    best = explanation.fit
    hypothesis: Hypothesis = best.hypothesis
    if explanation.stochastic is not None and explanation.stochastic.display is not None:
        hypothesis = ShownHypothesis.of(hypothesis, explanation.stochastic.display)
    measured = best.measured
    means, sds = hypothesis.prior_means, hypothesis.prior_sds
    covariance = np.linalg.inv(best.precision())
    factor = np.linalg.cholesky(0.5 * (covariance + covariance.T) + 1e-14 * np.diag(np.diag(covariance)))
    proposal = StudentTMixture(np.ones(1), best.coordinates[None], np.asarray(factor[None], np.float64))

    def log_density(points: FloatArray) -> FloatArray:
        totals = -0.5 * np.sum(((points - means) / sds) ** 2, axis=1)
        for record, y in enumerate(hypothesis.simulate_batch(hypothesis.to_values(points))):
            white = best.whitener.whiten(measured[record][:, None] - y, record)
            totals -= 0.5 * np.sum(white**2, axis=0)
        return np.where(np.isfinite(totals), totals, -np.inf)

    seed = int(rng.integers(2**31))
    start = proposal.sample(WALKERS, rng)
    begin = time.perf_counter()
    log_density(start[:8])
    a_step = (time.perf_counter() - begin) * WALKERS / 8
    steps = int(min(MAX_STEPS, seconds / max(a_step, 1e-9) - 1))
    if steps <= BURN_IN:
        chain = proposal.sample(512, rng)
    else:
        moves = [(IndependenceMove(proposal), INDEPENDENCE_WEIGHT), (DEMove(), 1 - INDEPENDENCE_WEIGHT)]
        sampler = EnsembleSampler(WALKERS, len(means), log_density, moves=moves, vectorize=True)
        sampler.random_state = np.random.RandomState(np.random.MT19937(seed)).get_state()
        sampler.run_mcmc(start, steps, skip_initial_state_check=True)
        chain = sampler.get_chain(discard=BURN_IN, flat=True)
    return np.asarray(chain), hypothesis.to_values(chain)
