"""The modal (parallel) form of the cascade, for many parameter vectors at once.

Partial fractions of the linear block for distinct poles (Oppenheim and Schafer, Discrete-Time Signal
Processing, sec. 3.3):

    G(z) = direct + sum_i r_i / (z - p_i),    r_i = gain prod_j (p_i - z_j) / prod_{j != i} (p_i - p_j)

A conjugate pair p, p* with residues r, r* is one real second-order section with
a1 = 2 Re p, a2 = |p|^2, b1 = 2 Re r, b2 = -2 Re(r p*).

Residues of many linear blocks at once, compiled.

For distinct poles (Oppenheim and Schafer, Discrete-Time Signal Processing, sec. 3.3)

    r_i = gain prod_j (p_i - z_j) / prod_{j != i} (p_i - p_j)

with LANES walkers advancing together, so that the residues cost little beside a simulation.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from bayes_hw.arrays import BoolArray, ComplexArray, FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.model.block_of_fractions import block_of_fractions
from bayes_hw.model.lanes import LANES, broadcast, filled_up, load, store
from bayes_hw.model.linear import LinearBlock


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


@compiled
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


@compiled
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


Roots = TypeVar("Roots", FloatArray, ComplexArray)

SEPARATION = 1e-5
"""Poles closer than this are moved apart symmetrically, so that their residues stay bounded.

The relative error of the response of a double pole is of the order of (SEPARATION x samples that the pole
remembers)^2, and rounding adds about 1e-16 / SEPARATION.
"""


@dataclass(frozen=True, eq=False)
class ModalForm:
    """Coefficients of `walkers` cascades, the walker along the last axis.

    `static` has shape (7, walkers): lower, upper, c1, half_width, c2, c3, direct. `real` has shape
    (2, n_real, walkers): pole, residue. `pairs` has shape (4, n_pairs, walkers): a1, a2, b1, b2.
    `real_state` (n_real, walkers) and `pair_state` (2, n_pairs, walkers) are the states before the first
    sample. `known` (n, walkers) weighs the signals of known inputs.
    """

    static: FloatArray
    real: FloatArray
    pairs: FloatArray
    real_state: FloatArray
    pair_state: FloatArray
    known: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def walkers(self) -> int:
        return int(self.static.shape[1])


@dataclass(frozen=True, eq=False)
class LinearBatch:
    """Linear blocks that share their structure: roots sorted into real ones and upper halves of pairs.

    `real_poles` (n_real, walkers), `pair_poles` (n_pairs, walkers) complex with positive imaginary part,
    `zeros` (n_zeros, walkers) complex, all of them, or (n_zeros, 1) where all walkers share them, `gain`
    (walkers,).
    """

    real_poles: FloatArray
    pair_poles: ComplexArray
    zeros: ComplexArray
    gain: FloatArray

    def separated(self) -> LinearBatch:
        """The same blocks with coinciding poles moved apart; the others are left as they are."""
        return replace(self, real_poles=moved_apart(self.real_poles), pair_poles=moved_apart(self.pair_poles))

    def residues(self) -> tuple[FloatArray, ComplexArray, FloatArray]:
        """Residues at the real poles and at the pair poles, and the direct term (walkers,).

        The poles must be distinct: see `separated`.
        """
        real, pairs = partial_fractions(self.real_poles, self.pair_poles, self.zeros, self.gain)
        proper = len(self.zeros) < len(self.real_poles) + 2 * len(self.pair_poles)
        return real, pairs, np.zeros_like(self.gain) if proper else self.gain

    def _numerator_at(self, z: ComplexArray) -> ComplexArray:
        """B(z) of every walker at points z of shape (points, walkers) or (points, 1)."""
        value = np.zeros(np.broadcast_shapes(z.shape, (1, len(self.gain))), dtype=np.complex128)
        value += self.gain
        for zero in self.zeros:
            value = value * (z - zero)
        return value

    def frequency_response(
        self, frequency_hz: FloatArray, sample_rate_hz: float, delay_samples: int
    ) -> ComplexArray:
        """G(exp(2 pi i f / rate)) of every walker, shape (walkers, frequencies)."""
        z = np.exp(2j * np.pi * frequency_hz / sample_rate_hz)
        response = self._numerator_at(z[:, None]).T * z ** (-delay_samples)
        for pole in (*self.real_poles.astype(np.complex128), *self.pair_poles, *self.pair_poles.conj()):
            response = response / (z - pole[:, None])
        return np.asarray(response, dtype=np.complex128)

    def block(self, poles: ComplexArray, delay_samples: int) -> LinearBlock:
        """The block of one column, its `poles` with their conjugates at the end."""
        return LinearBlock(self.zeros[:, 0], poles, float(self.gain[0]), delay_samples)


@dataclass(frozen=True, eq=False)
class ResidueBatch:
    """Linear blocks given by their poles and residues, so that no two poles need be distinct.

    `real_poles`, `real_residues` (n_real, walkers), `pair_poles`, `pair_residues` (n_pairs, walkers) complex,
    `direct` (walkers,).
    """

    real_poles: FloatArray
    pair_poles: ComplexArray
    real_residues: FloatArray
    pair_residues: ComplexArray
    direct: FloatArray

    def separated(self) -> ResidueBatch:
        """Itself: given residues are bounded wherever the poles are."""
        return self

    def residues(self) -> tuple[FloatArray, ComplexArray, FloatArray]:
        """Residues at the real poles and at the pair poles, and the direct term (walkers,)."""
        return self.real_residues, self.pair_residues, self.direct

    def frequency_response(
        self, frequency_hz: FloatArray, sample_rate_hz: float, delay_samples: int
    ) -> ComplexArray:
        """G(exp(2 pi i f / rate)) of every walker, shape (walkers, frequencies)."""
        z = np.exp(2j * np.pi * frequency_hz / sample_rate_hz)
        response = np.repeat(self.direct[:, None].astype(np.complex128), len(z), axis=1)
        poles = np.concatenate(
            [self.real_poles.astype(np.complex128), self.pair_poles, self.pair_poles.conj()]
        )
        residues = np.concatenate(
            [self.real_residues.astype(np.complex128), self.pair_residues, self.pair_residues.conj()]
        )
        for pole, residue in zip(poles, residues, strict=True):
            response += residue[:, None] / (z - pole[:, None])
        return np.asarray(response * z ** (-delay_samples), dtype=np.complex128)

    def block(self, poles: ComplexArray, delay_samples: int) -> LinearBlock:
        """The block of one column: `poles` are the real ones, then the pairs, then the conjugates."""
        residues, count = self.pair_residues[:, 0], len(self.real_residues)
        real = np.stack([poles[:count].real, self.real_residues[:, 0]])
        pairs = poles[count : count + len(residues)]
        over = np.stack([residues.real, -np.real(residues * pairs.conj())])
        sections = 2 * np.stack([pairs.real, np.abs(pairs) ** 2 / 2, *over])
        return block_of_fractions(real, sections, float(self.direct[0]), poles, delay_samples)


def numerator_coefficient(linear: LinearBatch | ResidueBatch, drop: int) -> FloatArray:
    """The coefficient (walkers,) of G's numerator `drop` powers of z below the degree of its denominator.

    Numerator over denominator is the series of the pulse response h in 1/z, so that it is the sum of a_k
    h_(drop - k) over k, with a_k the coefficients of the monic denominator.
    """
    real, pairs, direct = linear.residues()
    poles = np.concatenate(
        [linear.real_poles.astype(np.complex128), linear.pair_poles, linear.pair_poles.conj()]
    )
    residues = np.concatenate([real.astype(np.complex128), pairs, pairs.conj()])
    pulse = [direct, *((residues * poles**k).sum(axis=0).real for k in range(drop))]
    denominator = np.zeros((drop + 1, len(direct)), dtype=np.complex128)
    denominator[0] = 1.0
    for pole in poles:
        denominator[1:] -= pole * denominator[:-1].copy()
    return np.sum([denominator[k].real * pulse[drop - k] for k in range(drop + 1)], axis=0)


def moved_apart(poles: Roots) -> Roots:
    """`poles` (n, walkers) with each two that are closer than SEPARATION set that far apart."""
    if not any_closer_than(poles, SEPARATION):
        return poles
    moved = poles.copy()
    for i in range(len(moved)):
        for j in range(i):
            close = np.abs(moved[i] - moved[j]) < SEPARATION
            if np.any(close):
                middle = (moved[i] + moved[j]) / 2
                moved[i] = np.where(close, middle - SEPARATION / 2, moved[i])
                moved[j] = np.where(close, middle + SEPARATION / 2, moved[j])
    return moved


def modal_form(linear: LinearBatch | ResidueBatch, static: FloatArray) -> ModalForm:
    """The modal form of cascades with rows lower, upper, c1, half_width, c2, c3 in `static` (6, walkers), at
    rest with w = 0."""
    linear = linear.separated()
    walkers = static.shape[1]
    real_residues, pair_residues, direct = linear.residues()
    poles = linear.pair_poles
    form = ModalForm(
        static=np.empty((7, walkers)),
        real=np.empty((2, len(linear.real_poles), walkers)),
        pairs=np.empty((4, len(poles), walkers)),
        real_state=np.zeros((len(linear.real_poles), walkers)),
        pair_state=np.zeros((2, len(poles), walkers)),
    )
    form.static[:6], form.static[6] = static, direct
    form.real[0], form.real[1] = linear.real_poles, real_residues
    form.pairs[0] = 2 * poles.real
    form.pairs[1] = poles.real**2 + poles.imag**2
    form.pairs[2] = 2 * pair_residues.real
    form.pairs[3] = -2 * (pair_residues.real * poles.real + pair_residues.imag * poles.imag)
    return form


def linear_batch(block: LinearBlock, walkers: int) -> LinearBatch:
    """`walkers` copies of one linear block."""
    poles = block.poles
    real = poles[poles.imag == 0].real
    upper = poles[poles.imag > 0]
    return LinearBatch(
        np.repeat(real[:, None], walkers, axis=1),
        np.repeat(upper[:, None], walkers, axis=1),
        block.zeros[:, None],
        np.full(walkers, block.gain),
    )
