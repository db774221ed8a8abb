"""One emcee ensemble that can be advanced in blocks and stored between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from emcee import EnsembleSampler, State
from emcee.moves import Move
from numpy.typing import NDArray

from bayes_hw.arrays import FloatArray

RandomState: TypeAlias = tuple[str, NDArray[np.uint32], int, int, float]
LogDensity: TypeAlias = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True, eq=False)
class EnsembleState:
    """Walkers (walkers, parameters), their log-densities (walkers,) and the state of their generator."""

    coordinates: FloatArray
    log_probability: FloatArray
    random_state: RandomState


def start_ensemble(coordinates: FloatArray, log_density: LogDensity, seed: int) -> EnsembleState:
    """The state of an ensemble at the given walkers with a fresh generator."""
    random_state = np.random.RandomState(np.random.MT19937(seed)).get_state()
    return EnsembleState(coordinates, log_density(coordinates), random_state)  # type: ignore[arg-type]


class VectorSampler(EnsembleSampler):  # type: ignore[misc]
    """emcee's sampler for log-densities that take and give whole arrays and never give NaN.

    emcee itself goes through the results one by one.
    """

    def compute_log_prob(self, coords: FloatArray) -> tuple[FloatArray, None]:
        """Log-densities (walkers,) and no blobs: emcee's interface."""
        return self.log_prob_fn(coords), None


def advance(
    state: EnsembleState,
    log_density: LogDensity,
    moves: Sequence[tuple[Move, float]],
    steps: int,
) -> tuple[FloatArray, FloatArray, float, EnsembleState]:
    """Run `steps` steps: chain (steps, walkers, parameters), log-density (steps, walkers), accepted
    fraction, and the state after them. The same state gives the same result.

    The moves are copied: emcee's keep what belongs to one ensemble in themselves, and others run beside it.
    """
    walkers, dimension = state.coordinates.shape
    own_moves = [(copy(move), weight) for move, weight in moves]
    sampler = VectorSampler(walkers, dimension, log_density, moves=own_moves, vectorize=True)
    start = State(state.coordinates, log_prob=state.log_probability, random_state=state.random_state)
    end = sampler.run_mcmc(start, steps, skip_initial_state_check=True)
    after = EnsembleState(np.ascontiguousarray(end.coords), end.log_prob, end.random_state)
    return (
        sampler.get_chain(),
        sampler.get_log_prob(),
        float(np.mean(sampler.acceptance_fraction)),
        after,
    )
