"""Draws of something simpler than the exact posterior, weighed by that and drawn again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from arviz_stats.base import array_stats

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.log_posterior import LogPosterior

WALKERS = 32
"""Columns that the draws of an ensemble are dealt to."""

LARGEST_PARETO_K = 0.7
"""Of the tail of the weights: beyond it importance weights are not to be relied on."""

StandIn: TypeAlias = Literal["expanded_likelihood", "following_weights"]
"""What the draws were made of: `bayes_hw.infer.long_records` or `bayes_hw.infer.following_weights`."""


@dataclass(frozen=True)
class Reweighting:
    """How well `of` stood in for the likelihood of all samples: draws that were weighed, their effective
    number, Pareto's k of the weights' tail."""

    of: StandIn
    samples: int
    draws: int
    effective: float
    pareto_k: float

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
        }


def reweighted(
    of: StandIn,
    chain: FloatArray,
    log_stand_in: FloatArray,
    target: LogPosterior,
    rng: np.random.Generator,
    most: int | None = None,
) -> tuple[FloatArray, FloatArray, Reweighting]:
    """Draws of `target` from a chain on what stands in for it, and how good the weights are.

    `chain` (ensembles, steps, walkers, parameters) and `log_stand_in` without the last axis; of every
    ensemble `most` draws are weighed, all unless given. Importance weights are Pareto smoothed (Vehtari et
    al., doi 10.48550/arXiv.1507.02646), and as many draws as they are worth are drawn again by them,
    systematically (Douc, Cappe and Moulines, doi 10.1109/ISPA.2005.195385): (ensembles, steps, WALKERS,
    parameters) in random order, and their log-density.
    """
    ensembles, dimension = len(chain), chain.shape[-1]
    flat, log_flat = chain.reshape(ensembles, -1, dimension), log_stand_in.reshape(ensembles, -1)
    picked = np.stack([rng.permutation(flat.shape[1])[:most] for _ in range(ensembles)])
    draws = np.take_along_axis(flat, picked[..., None], axis=1)
    log_target = target(draws.reshape(-1, dimension)).reshape(picked.shape)
    log_weights = log_target - np.take_along_axis(log_flat, picked, axis=1)
    smoothed, pareto_k = array_stats.psislw(-log_weights.ravel())
    weights = np.exp(smoothed - np.max(smoothed)).reshape(picked.shape)
    effective = float(weights.sum() ** 2 / np.sum(weights**2))
    steps = max(1, int(effective) // (ensembles * WALKERS))
    again = np.empty((ensembles, steps * WALKERS), dtype=np.int64)
    for e, own in enumerate(weights):
        levels = (np.arange(again.shape[1]) + rng.random()) / again.shape[1]
        again[e] = rng.permutation(np.searchsorted(np.cumsum(own) / own.sum(), levels))
    again = np.minimum(again, picked.shape[1] - 1)
    shape = (ensembles, steps, WALKERS)
    states = np.take_along_axis(draws, again[..., None], axis=1).reshape(*shape, dimension)
    heights = np.take_along_axis(log_target, again, axis=1).reshape(shape)
    samples = sum(len(record) for record in target.records)
    return states, heights, Reweighting(of, samples, picked.size, effective, float(pareto_k))
