"""The cascade in modal coordinates, for identification when no zeros or poles are known yet.

    w(k) = r_I sum_{j<k} v(j - d) + sum_i (real pole)_i + sum_i (second-order section)_i

with d the delay. A second-order section s(k) = v(k) + a1 s(k-1) - a2 s(k-2) contributes b1 s(k-1) + b2
s(k-2). Its denominator is given by reflection coefficients, a2 = k2 and a1 = k1 (1 + k2) with |k1|, |k2| <
1 (Schur and Cohn; Oppenheim and Schafer, Discrete-Time Signal Processing, sec. 11.7): every coordinate
gives a stable section, and a pair of real poles turns into a complex pair without a seam. The output is
linear in b1, b2 and in the initial states.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.model.kernel import simulate_batch
from bayes_hw.model.modal import ModalForm
from bayes_hw.record import Record

MAX_REFLECTION = 1 - 1e-7
"""Largest modulus of a starting reflection coefficient; its inverse hyperbolic tangent stays finite."""

SINGULAR = 1e-14
"""A section whose zero lies so near to one of its poles cannot begin with everything."""


@dataclass(frozen=True)
class Structure:
    """What a cascade consists of.

    `delay_samples` before the linear block, which is strictly proper; whether it has an integrator, how many
    first-order and second-order sections; whether the saturation limits, the dead zone and a constant added
    to the command are estimated; whether every record has initial states of its own (else rest at w = 0).
    """

    delay_samples: int
    integrator: bool
    real_poles: int
    sections: int
    lower: bool = False
    upper: bool = False
    dead_zone: bool = False
    input_offset: bool = False
    free_start: bool = False

    @property
    def order(self) -> int:
        """Number of poles of G, the integrator included, the delay not."""
        return int(self.integrator) + self.real_poles + 2 * self.sections

    @property
    def n_static(self) -> int:
        return self.lower + self.upper + self.dead_zone + self.input_offset

    @property
    def n_linear(self) -> int:
        return int(self.integrator) + 2 * self.real_poles + 4 * self.sections

    def size(self, records: int) -> int:
        """Length of the coordinate vector."""
        return self.n_static + self.n_linear + (records * self.order if self.free_start else 0)

    @classmethod
    def of_order(cls, order: int, delay_samples: int, integrator: bool) -> Structure:
        """A purely linear cascade with `order` poles, as many of them in sections as possible."""
        rest = order - int(integrator)
        return cls(delay_samples, integrator, rest % 2, rest // 2)


@dataclass(frozen=True, eq=False)
class CascadeValues:
    """One parameter vector in natural form; limits are infinite and `half_width` zero where absent.

    `real` has shape (2, n_real): pole, residue; `sections` (4, n_sections): a1, a2, b1, b2; `starts` has
    shape (records, order): the free response of the integrator and of each real pole at the first sample,
    then that of every section there and its step to the second.
    """

    lower: float
    upper: float
    half_width: float
    input_offset: float
    integrator_residue: float
    real: FloatArray
    sections: FloatArray
    starts: FloatArray


def to_values(structure: Structure, coordinates: FloatArray, records: int) -> CascadeValues:
    """The parameter vector at `coordinates`, shape (size,)."""
    rows = _rows(structure, coordinates[:, None], records)
    return CascadeValues(
        lower=float(rows.lower[0]),
        upper=float(rows.upper[0]),
        half_width=float(rows.half_width[0]),
        input_offset=float(rows.input_offset[0]),
        integrator_residue=float(rows.real[1, 0, 0]) if structure.integrator else 0.0,
        real=rows.real[:, int(structure.integrator) :, 0],
        sections=rows.sections[:, :, 0],
        starts=rows.starts[:, :, 0],
    )


def to_coordinates(structure: Structure, values: CascadeValues) -> FloatArray:
    """Coordinates of a parameter vector: logarithms of limits and half width, atanh of poles and
    reflections."""
    parts: list[FloatArray] = []
    if structure.lower:
        parts.append(np.array([np.log(-values.lower)]))
    if structure.upper:
        parts.append(np.array([np.log(values.upper)]))
    if structure.dead_zone:
        parts.append(np.array([np.log(values.half_width)]))
    if structure.input_offset:
        parts.append(np.array([values.input_offset]))
    if structure.integrator:
        parts.append(np.array([values.integrator_residue]))
    parts.append(np.concatenate([_atanh(values.real[0]), values.real[1]]))
    a1, a2, b1, b2 = values.sections
    parts.append(np.concatenate([_atanh(a1 / (1 + a2)), _atanh(a2), b1, b2]))
    if structure.free_start:
        parts.append(values.starts.ravel())
    return np.concatenate(parts)


def simulate(structure: Structure, coordinates: FloatArray, records: Sequence[Record]) -> list[FloatArray]:
    """Output of every record for each column of `coordinates` (size, walkers): arrays (walkers, samples)."""
    rows = _rows(structure, coordinates, len(records))
    outputs = []
    for number, record in enumerate(records):
        form = _modal_form(rows, number)
        before = float(record.u[0]) if structure.free_start else 0.0
        y = simulate_batch(form, record.u, structure.delay_samples, before).y
        if structure.input_offset:
            step = _without_nonlinearity(form)
            ones = np.ones(len(record))
            y = y + rows.input_offset[:, None] * simulate_batch(step, ones, 0, 0.0).y
        outputs.append(y)
    return outputs


def intermediate_signal(
    structure: Structure, values: CascadeValues, records: Sequence[Record]
) -> list[FloatArray]:
    """w of every record, shape (samples,) each."""
    rows = _rows(structure, to_coordinates(structure, values)[:, None], len(records))
    signals = []
    for number, record in enumerate(records):
        form = _modal_form(rows, number)
        before = float(record.u[0]) if structure.free_start else 0.0
        signals.append(simulate_batch(form, record.u, structure.delay_samples, before).w[0])
    return signals


@dataclass(frozen=True, eq=False)
class _Rows:
    """Natural parameters of many walkers, the walker along the last axis; the integrator is real pole 0."""

    lower: FloatArray
    upper: FloatArray
    half_width: FloatArray
    input_offset: FloatArray
    real: FloatArray
    sections: FloatArray
    starts: FloatArray


def _rows(structure: Structure, coordinates: FloatArray, records: int) -> _Rows:
    walkers = coordinates.shape[1]
    position = 0

    def take(count: int) -> FloatArray:
        nonlocal position
        position += count
        return coordinates[position - count : position]

    constant = np.ones(walkers)
    lower = -np.exp(take(1)[0]) if structure.lower else -np.inf * constant
    upper = np.exp(take(1)[0]) if structure.upper else np.inf * constant
    half_width = np.exp(take(1)[0]) if structure.dead_zone else 0 * constant
    offset = take(1)[0] if structure.input_offset else 0 * constant
    integrator = take(int(structure.integrator))
    poles, residues = np.tanh(take(structure.real_poles)), take(structure.real_poles)
    k1, k2 = np.tanh(take(structure.sections)), np.tanh(take(structure.sections))
    b1, b2 = take(structure.sections), take(structure.sections)
    starts = (
        take(records * structure.order).reshape(records, structure.order, walkers)
        if structure.free_start
        else np.zeros((records, structure.order, walkers))
    )
    real = np.stack(
        [
            np.concatenate([np.ones_like(integrator), poles]),
            np.concatenate([integrator, residues]),
        ]
    )
    return _Rows(lower, upper, half_width, offset, real, np.stack([k1 * (1 + k2), k2, b1, b2]), starts)


def _modal_form(rows: _Rows, record: int) -> ModalForm:
    ones = np.ones(len(rows.lower))
    static = np.stack([rows.lower, rows.upper, ones, rows.half_width, ones, ones, 0 * ones])
    starts = rows.starts[record]
    n_real = rows.real.shape[1]
    residues = np.where(rows.real[1] == 0, 1.0, rows.real[1])
    pairs = _section_states(rows.sections, starts[n_real::2], starts[n_real::2] + starts[n_real + 1 :: 2])
    return ModalForm(static, rows.real, rows.sections, starts[:n_real] / residues, pairs)


def _section_states(sections: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """States s(-1), s(-2) that give the first two samples of the free response of sections (4, n, walkers);
    zero for one without weights."""
    a1, a2, b1, b2 = sections
    determinant = b1 * b1 * a2 + a1 * b1 * b2 + b2 * b2
    lost = np.abs(determinant) <= SINGULAR * (b1 * b1 + b2 * b2)
    inverse = np.where(lost, 0.0, 1 / np.where(lost, 1.0, determinant))
    return np.stack([b1 * a2 * first + b2 * second, (b1 * a1 + b2) * first - b1 * second]) * inverse


def _without_nonlinearity(form: ModalForm) -> ModalForm:
    static = form.static.copy()
    static[0], static[1], static[3] = -np.inf, np.inf, 0.0
    return replace(
        form,
        static=static,
        real_state=np.zeros_like(form.real_state),
        pair_state=np.zeros_like(form.pair_state),
    )


def _atanh(values: FloatArray) -> FloatArray:
    return np.arctanh(np.clip(values, -MAX_REFLECTION, MAX_REFLECTION))
