"""Draws of an approximate log-posterior as states of a chain on the exact one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from arviz_stats.base import array_stats

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.log_posterior import LogPosterior

WALKERS, STEPS = 32, 16
"""Of every ensemble whose states the likelihood of all samples decides on."""

LARGEST_PARETO_K = 0.7
"""Of the tail of the weights: beyond it importance weights are not to be relied on."""


@dataclass(frozen=True)
class Reweighting:
    """How well an expanded likelihood stood in for that of all samples: draws that were weighed, their
    effective number, Pareto's k of the weights' tail, share of proposed states accepted."""

    samples: int
    draws: int
    effective: float
    pareto_k: float
    acceptance: float

    @property
    def holds(self) -> bool:
        return self.pareto_k <= LARGEST_PARETO_K

    def to_dict(self) -> dict[str, float | int]:
        """The entry `expanded_likelihood` of posterior.json."""
        return {
            "samples": self.samples,
            "draws": self.draws,
            "effective": self.effective,
            "pareto_k": self.pareto_k,
            "acceptance": self.acceptance,
        }


def reweighted(
    chain: FloatArray, log_expanded: FloatArray, target: LogPosterior, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray, Reweighting]:
    """States of a chain on `target` proposed by draws of a chain on its expansion.

    `chain` (ensembles, steps, walkers, parameters) and `log_expanded` without the last axis. Draws of every
    ensemble are dealt to WALKERS walkers; the first state of each is drawn by importance weights, every later
    one is accepted with the ratio of weights (Liu, Monte Carlo Strategies in Scientific Computing, sec. 5.4).
    Returns states (ensembles, STEPS, WALKERS, parameters), their log-density, and how good the weights are.
    """
    ensembles, dimension = len(chain), chain.shape[-1]
    count = WALKERS * (STEPS + 1)
    flat, log_flat = chain.reshape(ensembles, -1, dimension), log_expanded.reshape(ensembles, -1)
    picked = np.stack([rng.permutation(flat.shape[1])[:count] for _ in range(ensembles)])
    draws = np.take_along_axis(flat, picked[..., None], axis=1)
    expanded = np.take_along_axis(log_flat, picked, axis=1)
    log_target = target(draws.reshape(-1, dimension)).reshape(ensembles, count)
    log_weights = log_target - expanded
    smoothed, pareto_k = array_stats.psislw(-log_weights.ravel())
    weights = np.exp(smoothed - np.max(smoothed))
    effective = float(weights.sum() ** 2 / np.sum(weights**2))
    states = np.empty((ensembles, STEPS, WALKERS, dimension))
    heights = np.empty((ensembles, STEPS, WALKERS))
    accepted = 0
    for e in range(ensembles):
        own = np.exp(log_weights[e] - np.max(log_weights[e]))
        now = rng.choice(count, WALKERS, p=own / own.sum())
        deals = rng.permutation(count)[: STEPS * WALKERS].reshape(STEPS, WALKERS)
        for step, deal in enumerate(deals):
            moves = np.log(rng.random(WALKERS)) < log_weights[e, deal] - log_weights[e, now]
            now = np.where(moves, deal, now)
            accepted += int(np.count_nonzero(moves))
            states[e, step], heights[e, step] = draws[e, now], log_target[e, now]
    share = accepted / (ensembles * STEPS * WALKERS)
    samples = sum(len(record) for record in target.records)
    judged = Reweighting(samples, ensembles * count, effective, float(pareto_k), share)
    return states, heights, judged
