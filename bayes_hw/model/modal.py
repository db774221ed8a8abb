"""The modal (parallel) form of the cascade, for many parameter vectors at once.

Partial fractions of the linear block for distinct poles (Oppenheim and Schafer, Discrete-Time Signal
Processing, sec. 3.3):

    G(z) = direct + sum_i r_i / (z - p_i),    r_i = gain prod_j (p_i - z_j) / prod_{j != i} (p_i - p_j)

A conjugate pair p, p* with residues r, r* is one real second-order section with
a1 = 2 Re p, a2 = |p|^2, b1 = 2 Re r, b2 = -2 Re(r p*).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.model.linear import LinearBlock

SEPARATION = 1e-5
"""Poles closer than this are moved apart symmetrically: the error is its square, the residues stay bounded."""


@dataclass(frozen=True, eq=False)
class ModalForm:
    """Coefficients of `walkers` cascades, the walker along the last axis.

    `static` has shape (7, walkers): lower, upper, c1, half_width, c2, c3, direct. `real` has shape
    (2, n_real, walkers): pole, residue. `pairs` has shape (4, n_pairs, walkers): a1, a2, b1, b2.
    `real_state` (n_real, walkers) and `pair_state` (2, n_pairs, walkers) are the states before the first sample.
    """

    static: FloatArray
    real: FloatArray
    pairs: FloatArray
    real_state: FloatArray
    pair_state: FloatArray

    @property
    def walkers(self) -> int:
        return int(self.static.shape[1])


@dataclass(frozen=True, eq=False)
class LinearBatch:
    """Linear blocks that share their structure: roots sorted into real ones and upper halves of pairs.

    `real_poles` (n_real, walkers), `pair_poles` (n_pairs, walkers) complex with positive imaginary part,
    `zeros` (n_zeros, walkers) complex, all of them, `gain` (walkers,).
    """

    real_poles: FloatArray
    pair_poles: ComplexArray
    zeros: ComplexArray
    gain: FloatArray

    def residues(self) -> tuple[FloatArray, ComplexArray, FloatArray]:
        """Residues at the real poles and at the pair poles, and the direct term (walkers,)."""
        pairs = self.pair_poles
        poles = np.concatenate([self.real_poles.astype(np.complex128), pairs, pairs.conj()])
        poles = _separated(poles, len(self.real_poles))
        n_upper = len(self.real_poles) + len(pairs)
        numerator = np.broadcast_to(self.gain, (n_upper, len(self.gain))).astype(np.complex128)
        for zero in self.zeros:
            numerator = numerator * (poles[:n_upper] - zero)
        denominator = np.ones_like(numerator)
        for j, pole in enumerate(poles):
            difference = poles[:n_upper] - pole
            if j < n_upper:
                difference[j] = 1.0
            denominator *= difference
        residues = numerator / denominator
        direct = self.gain if len(self.zeros) == len(poles) else np.zeros_like(self.gain)
        return residues[: len(self.real_poles)].real, residues[len(self.real_poles) :], direct


def _separated(poles: ComplexArray, n_real: int) -> ComplexArray:
    """Move coinciding real poles apart by SEPARATION; every other configuration is left as it is."""
    real = poles[:n_real].copy()
    for i in range(n_real):
        for j in range(i):
            close = np.abs(real[i] - real[j]) < SEPARATION
            if np.any(close):
                middle = (real[i] + real[j]) / 2
                real[i] = np.where(close, middle - SEPARATION / 2, real[i])
                real[j] = np.where(close, middle + SEPARATION / 2, real[j])
    return np.concatenate([real, poles[n_real:]])


def modal_form(
    linear: LinearBatch,
    static: FloatArray,
    initial_position: FloatArray | None = None,
) -> ModalForm:
    """The modal form of cascades with rows lower, upper, c1, half_width, c2, c3 in `static` (6, walkers).

    `initial_position` (walkers,) is w before the first sample, held by the integrator (the real pole nearest
    z = 1); the default is rest at w = 0.
    """
    walkers = static.shape[1]
    real_residues, pair_residues, direct = linear.residues()
    pair_poles = linear.pair_poles
    real_state = np.zeros((len(linear.real_poles), walkers))
    if initial_position is not None:
        integrator = int(np.argmin(np.abs(linear.real_poles[:, 0] - 1)))
        real_state[integrator] = initial_position / real_residues[integrator]
    return ModalForm(
        static=np.concatenate([static, direct[None, :]]),
        real=np.stack([linear.real_poles, real_residues]),
        pairs=np.stack(
            [
                2 * pair_poles.real,
                np.abs(pair_poles) ** 2,
                2 * pair_residues.real,
                -2 * (pair_residues * pair_poles.conj()).real,
            ]
        ),
        real_state=real_state,
        pair_state=np.zeros((2, len(pair_poles), walkers)),
    )


def linear_batch(block: LinearBlock, walkers: int) -> LinearBatch:
    """`walkers` copies of one linear block."""
    poles = block.poles
    real = poles[poles.imag == 0].real
    upper = poles[poles.imag > 0]
    return LinearBatch(
        np.repeat(real[:, None], walkers, axis=1),
        np.repeat(upper[:, None], walkers, axis=1),
        np.repeat(block.zeros[:, None], walkers, axis=1),
        np.full(walkers, block.gain),
    )
