"""Draws of an approximate log-posterior as states of a chain on the exact one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from arviz_stats.base import array_stats

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.log_posterior import LogPosterior

WALKERS = 32
"""Of every ensemble whose states the likelihood of all samples decides on."""

STATES_PER_EFFECTIVE = 2.0
"""States for every effective sample that is asked for."""

LARGEST_PARETO_K = 0.7
"""Of the tail of the weights: beyond it importance weights are not to be relied on."""


StandIn: TypeAlias = Literal["expanded_likelihood", "following_roots"]
"""What the draws were made of: `bayes_hw.infer.expansion` or `bayes_hw.infer.following`."""


@dataclass(frozen=True)
class Reweighting:
    """How well `of` stood in for the likelihood of all samples: draws that were weighed, their effective
    number, Pareto's k of the weights' tail, share of proposed states accepted."""

    of: StandIn
    samples: int
    draws: int
    effective: float
    pareto_k: float
    acceptance: float

    @property
    def holds(self) -> bool:
        return self.pareto_k <= LARGEST_PARETO_K

    def to_dict(self) -> dict[str, float | int]:
        """The entry of posterior.json that `of` names."""
        return {
            "samples": self.samples,
            "draws": self.draws,
            "effective": self.effective,
            "pareto_k": self.pareto_k,
            "acceptance": self.acceptance,
        }


def reweighted(
    chain: FloatArray,
    log_stand_in: FloatArray,
    target: LogPosterior,
    rng: np.random.Generator,
    of: StandIn = "expanded_likelihood",
    target_ess: float = 1000.0,
) -> tuple[FloatArray, FloatArray, Reweighting]:
    """States of a chain on `target` proposed by draws of a chain on what stands in for it.

    `chain` (ensembles, steps, walkers, parameters) and `log_stand_in` without the last axis. Draws of every
    ensemble are dealt to WALKERS walkers; the first state of each is drawn by importance weights, every later
    one is accepted with the ratio of weights (Liu, Monte Carlo Strategies in Scientific Computing, sec. 5.4).
    Returns states (ensembles, steps, WALKERS, parameters), twice `target_ess` where there are as many draws,
    their log-density, and how good the weights are.
    """
    ensembles, dimension = len(chain), chain.shape[-1]
    flat, log_flat = chain.reshape(ensembles, -1, dimension), log_stand_in.reshape(ensembles, -1)
    wanted = round(STATES_PER_EFFECTIVE * target_ess / (ensembles * WALKERS))
    steps = min(max(wanted, 1), flat.shape[1] // WALKERS - 1)
    count = WALKERS * (steps + 1)
    picked = np.stack([rng.permutation(flat.shape[1])[:count] for _ in range(ensembles)])
    draws = np.take_along_axis(flat, picked[..., None], axis=1)
    stand_in = np.take_along_axis(log_flat, picked, axis=1)
    log_target = target(draws.reshape(-1, dimension)).reshape(ensembles, count)
    log_weights = log_target - stand_in
    smoothed, pareto_k = array_stats.psislw(-log_weights.ravel())
    weights = np.exp(smoothed - np.max(smoothed))
    effective = float(weights.sum() ** 2 / np.sum(weights**2))
    states = np.empty((ensembles, steps, WALKERS, dimension))
    heights = np.empty((ensembles, steps, WALKERS))
    accepted = 0
    for e in range(ensembles):
        own = np.exp(log_weights[e] - np.max(log_weights[e]))
        now = rng.choice(count, WALKERS, p=own / own.sum())
        deals = rng.permutation(count)[: steps * WALKERS].reshape(steps, WALKERS)
        for step, deal in enumerate(deals):
            moves = np.log(rng.random(WALKERS)) < log_weights[e, deal] - log_weights[e, now]
            now = np.where(moves, deal, now)
            accepted += int(np.count_nonzero(moves))
            states[e, step], heights[e, step] = draws[e, now], log_target[e, now]
    share = accepted / (ensembles * steps * WALKERS)
    samples = sum(len(record) for record in target.records)
    judged = Reweighting(of, samples, ensembles * count, effective, float(pareto_k), share)
    return states, heights, judged
