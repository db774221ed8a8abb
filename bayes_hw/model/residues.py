"""Residues of a linear block and weights that stay bounded where its poles coincide."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.model.modal import LinearBatch

NEGLIGIBLE = 1e-10
"""Residues this small beside the largest are rounding errors."""


def nested_weights(poles: FloatArray, residues: FloatArray) -> FloatArray:
    """Weights g with sum_i r_i / (z - p_i) = g_1 / (z - p_1) + g_2 / ((z - p_1) (z - p_2)) + ...

    They stay bounded where poles coincide, where residues do not. `poles` and `residues` (n, ...).
    """
    remaining, weights = residues.copy(), np.empty_like(residues)
    for j in range(len(poles)):
        weights[j] = remaining[j:].sum(axis=0)
        remaining[j + 1 :] *= poles[j + 1 :] - poles[j]
    return weights


def nested_residues(poles: FloatArray, weights: FloatArray) -> FloatArray:
    """The residues of distinct poles that have the given nested weights; the inverse of `nested_weights`."""
    residues = np.empty_like(weights)
    for j in reversed(range(len(poles))):
        residues[j + 1 :] /= poles[j + 1 :] - poles[j]
        residues[j] = weights[j] - residues[j + 1 :].sum(axis=0)
    return residues


def residues_at(
    batch: LinearBatch, real_poles: FloatArray, pair_poles: ComplexArray
) -> tuple[FloatArray, ComplexArray, FloatArray]:
    """Residues of a batch of one block, in the order of the given poles."""
    real, pairs, direct = batch.residues()
    real_order = [int(np.argmin(np.abs(batch.real_poles[:, 0] - pole))) for pole in real_poles]
    pair_order = [int(np.argmin(np.abs(batch.pair_poles[:, 0] - pole))) for pole in pair_poles]
    return real[real_order, 0], pairs[pair_order, 0], direct
