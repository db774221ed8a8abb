"""Residues of many linear blocks at once, compiled.

For distinct poles (Oppenheim and Schafer, Discrete-Time Signal Processing, sec. 3.3)

    r_i = gain prod_j (p_i - z_j) / prod_{j != i} (p_i - p_j)

with LANES walkers advancing together, so that the residues cost little beside a simulation.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bayes_hw.arrays import BoolArray, ComplexArray, FloatArray
from bayes_hw.model.lanes import LANES, broadcast, filled_up, load, store


def partial_fractions(
    real_poles: FloatArray, pair_poles: ComplexArray, zeros: ComplexArray, gain: FloatArray
) -> tuple[FloatArray, ComplexArray]:
    """Residues (n_real, walkers) at the real poles and (n_pairs, walkers) at the pair poles.

    `zeros` (n_zeros, walkers), or (n_zeros, 1) where all walkers share them; otherwise as for
    `bayes_hw.model.modal.LinearBatch`.
    """
    walkers, n_real = len(gain), len(real_poles)
    upper = np.zeros((2, n_real + len(pair_poles), walkers))
    upper[0, :n_real] = real_poles
    upper[0, n_real:], upper[1, n_real:] = pair_poles.real, pair_poles.imag
    upper = filled_up(upper)
    residues = np.empty_like(upper)
    split_zeros = filled_up(np.stack([zeros.real, zeros.imag]))
    _partial_fractions(upper, n_real, split_zeros, filled_up(gain), residues)
    real = residues[0, :n_real, :walkers]
    pairs = np.empty((len(pair_poles), walkers), dtype=np.complex128)
    pairs.real, pairs.imag = residues[:, n_real:, :walkers]
    return real, pairs


@njit(cache=True, error_model="numpy")
def _partial_fractions(poles, n_real, zeros, gain, residues):  # type: ignore[no-untyped-def]
    """Fill residues (2, poles, walkers): real and imaginary parts, as in `poles` and `zeros`."""
    count, groups = poles.shape[1], poles.shape[2] // LANES
    n_zeros, zero_groups = zeros.shape[1], zeros.shape[2] // LANES
    none = broadcast(0.0)
    for group in range(groups):
        for i in range(count):
            x, y = load(poles, i * groups + group), load(poles, (count + i) * groups + group)
            above, above_i = load(gain, group), none
            for j in range(n_zeros):
                a = x - load(zeros, j * zero_groups + group % zero_groups)
                b = y - load(zeros, (n_zeros + j) * zero_groups + group % zero_groups)
                above, above_i = above * a - above_i * b, above * b + above_i * a
            below, below_i = broadcast(1.0), none
            for j in range(count):
                a = x - load(poles, j * groups + group)
                q = load(poles, (count + j) * groups + group)
                if j != i:
                    b = y - q
                    below, below_i = below * a - below_i * b, below * b + below_i * a
                if j >= n_real:
                    b = y + q
                    below, below_i = below * a - below_i * b, below * b + below_i * a
            size = below * below + below_i * below_i
            store(residues, i * groups + group, (above * below + above_i * below_i) / size)
            store(residues, (count + i) * groups + group, (above_i * below - above * below_i) / size)


@njit(cache=True)
def closer_than(real, imag, distance):  # type: ignore[no-untyped-def]
    """Whether any two of the points (n, walkers) of one walker are closer than `distance`."""
    limit = distance * distance
    for i in range(len(real)):
        for j in range(i):
            found = 0
            for k in range(real.shape[1]):
                a, b = real[i, k] - real[j, k], imag[i, k] - imag[j, k]
                found += a * a + b * b < limit
            if found:
                return True
    return False


def any_closer_than(points: FloatArray | ComplexArray, distance: float) -> bool:
    """Whether any two of `points` (n, walkers) of one walker are closer than `distance`."""
    split: BoolArray = closer_than(
        np.ascontiguousarray(points.real), np.ascontiguousarray(points.imag), distance
    )
    return bool(split)
