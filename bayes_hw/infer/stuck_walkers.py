"""Stuck walkers, which side peaks of no weight hold, taken back before sampling begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.ensemble import EnsembleState


def without_strays(chain: FloatArray, log_density: FloatArray, state: EnsembleState) -> EnsembleState:
    """The ensemble `state` after settling steps, strays put where other walkers are.

    A stray did not move in all of `chain` (steps, walkers, parameters), and its `log_density` (steps,
    walkers) is below everything that the walkers that moved went through. What holds it is narrower than the
    posterior and lower: it has no weight, but a walker would not leave it by itself. A narrow peak that is
    higher may have weight and keeps its walkers, for the convergence tests to find.
    """
    stuck = np.all(chain == chain[0], axis=(0, 2))
    if stuck.all() or not stuck.any():
        return state
    strays = np.flatnonzero(stuck & (state.log_probability < np.min(log_density[:, ~stuck])))
    moving = np.flatnonzero(~stuck)
    coordinates, log_probability = state.coordinates.copy(), state.log_probability.copy()
    hosts = moving[np.arange(len(strays)) % len(moving)]
    coordinates[strays], log_probability[strays] = coordinates[hosts], log_probability[hosts]
    return replace(state, coordinates=coordinates, log_probability=log_probability)
