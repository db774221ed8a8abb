"""Output-error fit of a cascade in modal coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import (
    CascadeValues,
    Structure,
    simulate,
    to_coordinates,
    to_values,
)
from bayes_hw.identify.cascade_basis import linear_basis, with_linear_solution
from bayes_hw.identify.holes import with_holes
from bayes_hw.record import Record

DIFFERENCE_STEP = 1e-6
SMALLEST_LINEAR = 1e-3
"""Size below which the difference step of a residue or state does not shrink; the output is linear in
them."""

LOGARITHM_RANGE = 5.0
"""The logarithm of a limit or half width may move this far from its start."""

REFLECTION_RANGE = 8.0
"""Bound of the inverse hyperbolic tangent of poles and reflection coefficients: modulus 1 - 2e-7."""


@dataclass(frozen=True, eq=False)
class CascadeFit:
    """One least-squares estimate; `residuals` are measured minus simulated, one array per record, NaN where
    nothing was measured."""

    structure: Structure
    values: CascadeValues
    residuals: tuple[FloatArray, ...]

    @property
    def samples(self) -> int:
        """That were measured."""
        return sum(len(e) for e in self._known)

    @property
    def sum_of_squares(self) -> float:
        return float(sum(e @ e for e in self._known))

    @property
    def _known(self) -> list[FloatArray]:
        return [e[~np.isnan(e)] if np.isnan(e).any() else e for e in self.residuals]

    @property
    def rms(self) -> float:
        """Root mean square output error, output units."""
        return float(np.sqrt(self.sum_of_squares / self.samples))


def fit_cascade(
    structure: Structure,
    start: CascadeValues,
    records: Sequence[Record],
    *,
    max_evaluations: int = 60,
) -> CascadeFit:
    """Minimise the sum of squares of y minus simulated y over every parameter of `structure`, from `start`.

    Gauss-Newton in scipy's trust-region reflective form; the Jacobian by central differences, all columns in
    one call of the compiled kernel.
    """
    count = len(records)
    first = to_coordinates(structure, start)
    lower, upper = _bounds(structure, first)
    first = np.clip(first, lower + 1e-9, upper - 1e-9)
    measured = np.concatenate([record.y for record in records])
    counted = np.concatenate([record.measured_samples for record in records])
    whole = bool(counted.all())

    def simulated(coordinates: FloatArray) -> FloatArray:
        outputs = np.concatenate(simulate(structure, coordinates, records), axis=1)
        return outputs if whole else np.where(counted, outputs, measured)

    def residual(coordinates: FloatArray) -> FloatArray:
        return _finite(simulated(coordinates[:, None])[0] - measured)

    def jacobian(coordinates: FloatArray) -> FloatArray:
        steps = DIFFERENCE_STEP * np.maximum(np.abs(coordinates), _smallest(structure, coordinates))
        shifts = np.diag(steps)
        both = np.concatenate([coordinates[:, None] + shifts, coordinates[:, None] - shifts], axis=1)
        rows = simulated(both)
        half = len(coordinates)
        return _finite(((rows[:half] - rows[half:]) / (2 * steps[:, None])).T)

    solution = least_squares(
        residual,
        first,
        jac=jacobian,
        bounds=(lower, upper),
        x_scale="jac",
        max_nfev=max_evaluations,
        ftol=1e-9,
        xtol=1e-9,
        gtol=1e-12,
    )
    values = to_values(structure, np.asarray(solution.x, dtype=np.float64), count)
    return evaluated(structure, values, records)


def evaluated(structure: Structure, values: CascadeValues, records: Sequence[Record]) -> CascadeFit:
    """The residuals at given values, without any descent."""
    outputs = simulate(structure, to_coordinates(structure, values)[:, None], records)
    residuals = tuple(
        with_holes(r.y - output[0], r.measured) for r, output in zip(records, outputs, strict=True)
    )
    return CascadeFit(structure, values, residuals)


def solve_linear_part(
    structure: Structure,
    poles: CascadeValues,
    commands: Sequence[FloatArray],
    targets: Sequence[FloatArray],
    masks: Sequence[FloatArray],
    *,
    differenced: bool,
) -> tuple[CascadeValues, float]:
    """Residues and initial states that bring G v nearest to the targets, for given denominators.

    `commands` are v, `targets` w or (with `differenced`) both sides are differenced in time first; samples
    where a mask is zero do not count. Returns the values and the root mean square error left.
    """
    rows, right = [], []
    for block, target, mask in zip(linear_basis(structure, poles, commands), targets, masks, strict=True):
        chosen = mask > 0
        signals, wanted = (difference(block), difference(target)) if differenced else (block, target)
        rows.append(signals[:, chosen].T)
        right.append(wanted[chosen])
    matrix, vector = np.concatenate(rows), np.concatenate(right)
    solution = scaled_least_squares(matrix, vector)
    error = vector - matrix @ solution
    return (
        with_linear_solution(structure, poles, solution),
        float(np.sqrt(error @ error / max(len(error), 1))),
    )


def scaled_least_squares(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Minimum-norm least squares after every column is scaled to unit length."""
    lengths = np.linalg.norm(matrix, axis=0)
    lengths[lengths == 0] = 1.0
    return np.asarray(np.linalg.lstsq(matrix / lengths, vector, rcond=1e-10)[0] / lengths, dtype=np.float64)


def difference(values: FloatArray) -> FloatArray:
    """x(k) - x(k-1) along the last axis, zero at the first sample."""
    return np.diff(values, axis=-1, prepend=values[..., :1])


def _finite(values: FloatArray) -> FloatArray:
    return np.nan_to_num(values, nan=1e6, posinf=1e6, neginf=-1e6)


def _bounds(structure: Structure, start: FloatArray) -> tuple[FloatArray, FloatArray]:
    lower, upper = np.full(len(start), -np.inf), np.full(len(start), np.inf)
    logarithms = slice(0, structure.lower + structure.upper + structure.dead_zone)
    lower[logarithms] = start[logarithms] - LOGARITHM_RANGE
    upper[logarithms] = start[logarithms] + LOGARITHM_RANGE
    for part in _tangent_slices(structure):
        lower[part], upper[part] = -REFLECTION_RANGE, REFLECTION_RANGE
    return lower, upper


def _tangent_slices(structure: Structure) -> tuple[slice, slice]:
    real = structure.n_static + int(structure.integrator)
    sections = real + 2 * structure.real_poles
    return (
        slice(real, real + structure.real_poles),
        slice(sections, sections + 2 * structure.sections),
    )


def _smallest(structure: Structure, coordinates: FloatArray) -> FloatArray:
    """Sizes below which a difference step does not shrink: 1 for logarithms and inverse tangents."""
    sizes = np.full(len(coordinates), SMALLEST_LINEAR)
    sizes[: structure.n_static] = 1.0
    for part in _tangent_slices(structure):
        sizes[part] = 1.0
    return sizes
