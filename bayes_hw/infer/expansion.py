"""The log-posterior of long records with their residuals expanded to second order.

With many samples the posterior is narrow, and over it the residuals are nearly a quadratic function of the
coordinates. Their whitened products, taken once over all samples, then give the likelihood anywhere near at
a cost that does not depend on how long the records are:

    e(theta) = e(0) + sum_i z_i e_i + sum_(i <= j) z_i z_j e_ij,    theta = centre + factor z

so that the sum of squares is m' P m, m the monomials of z and P the products of the e. Divided differences
over STEP standard deviations give the e. The whitening is that of the noise at the centre; what the noise's
own coordinates change is exact there and carried over, since information on noise and response is
independent in large samples (Ljung, System Identification, sec. 9.4).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.kernel import LaggedSums, lagged_residual_sums
from bayes_hw.model.parameters import ParameterVector, as_values
from bayes_hw.model.streaming import simulated_blocks
from bayes_hw.record import Record

STEP = 1.5
"""Of the divided differences, in standard deviations."""

FARTHEST = 12.0
"""Standard deviations from the centre beyond which the expansion means nothing and counts as impossible."""


class Expansion:
    """log p(coordinates | records) as `LogPosterior` has it, the residuals expanded about `centre`.

    `centre` (parameters,) and `covariance` (parameters, parameters) are of all coordinates; those of the
    noise come last.
    """

    def __init__(self, target: LogPosterior, centre: FloatArray, covariance: FloatArray) -> None:
        axis, n_axis = target.axis, len(target.axis.parameters)
        self.target = target
        self.non_finite = 0
        self._centre = centre[:n_axis].copy()
        factor = np.linalg.cholesky(covariance[:n_axis, :n_axis])
        self._to_standard = np.linalg.inv(factor)
        self._vector = ParameterVector(target.parameters)
        partial = target.values(centre[None])[0, n_axis + 1 : n_axis + 1 + target.order]
        points, differences = _stencil(n_axis)
        rows = whitened_products(
            axis, target.records, self._centre[:, None] + factor @ points.T, Whitener.of_partial(partial)
        )
        self._products = differences @ rows @ differences.T
        self._sums = self._sums_at_centre()

    @property
    def names(self) -> tuple[str, ...]:
        return self.target.names

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        """Log-posterior density (walkers,) of coordinates (walkers, parameters)."""
        n_axis = len(self._centre)
        standard = (coordinates[:, :n_axis] - self._centre) @ self._to_standard.T
        columns = np.ascontiguousarray(coordinates.T)
        with np.errstate(all="ignore"):
            values = self._vector.values(columns)
            result = self._vector.log_prior(columns, values)
            possible = np.isfinite(result) & np.all(np.isfinite(values), axis=0)
            possible &= self.target.axis.in_order(values) & np.all(np.abs(standard) < FARTHEST, axis=1)
            sigma, partial = values[n_axis], values[n_axis + 1 :]
            innovation = sigma**2 * np.prod(1 - partial**2, axis=0)
            monomials = _monomials(standard)
            excess = np.einsum("nk,nk->n", monomials @ self._products, monomials) - self._products[0, 0]
            result += self.target.power * (self._at_centre(sigma, partial) - 0.5 * excess / innovation)
        result[~possible | ~np.isfinite(result)] = -np.inf
        return result

    def _sums_at_centre(self) -> list[LaggedSums]:
        axis, delay = self.target.axis, self.target.axis.model.linear.delay_samples
        values = as_values(axis.parameters, self._centre[:, None])
        found = []
        for number, record in enumerate(self.target.records):
            before = 0.0 if axis.start_positions is None else float(record.u[0])
            form = axis.modal_form(values, number)
            found.append(lagged_residual_sums(form, record.u, record.y, delay, self.target.order, before))
        return found

    def _at_centre(self, sigma: FloatArray, partial: FloatArray) -> FloatArray:
        """Exact log-likelihood (walkers,) of the residuals at the centre."""
        total = np.zeros(len(sigma))
        for number, sums in enumerate(self._sums):
            same = LaggedSums(*(np.repeat(part, len(sigma), axis=1) for part in sums))
            total += self.target.of_sums(same, number, sigma, partial)
        return total


def whitened_products(
    axis: AxisParameters, records: Sequence[Record], coordinates: FloatArray, whitener: Whitener
) -> FloatArray:
    """Products (points, points), over all samples, of the whitened residual at the first column of
    `coordinates` (axis parameters, points) and what the residuals of the others differ from it by; without
    what a level of a record explains, where that is free."""
    points, order = coordinates.shape[1], whitener.order
    values = as_values(axis.parameters, coordinates)
    products = np.zeros((points, points))
    for number, record in enumerate(records):
        form = axis.modal_form(values, number)
        before = 0.0 if axis.start_positions is None else float(record.u[0])
        kept = np.empty((points + 1, 0))
        own = np.zeros((points + 1, points + 1))
        for begin, y in simulated_blocks(form, record.u, axis.model.linear.delay_samples, before):
            rows = np.ones((points + 1, kept.shape[1] + y.shape[1]))
            rows[:, : kept.shape[1]] = kept
            rows[0, kept.shape[1] :] = record.y[begin : begin + y.shape[1]] - y[0]
            np.subtract(y[0], y[1:], out=rows[1:-1, kept.shape[1] :])
            innovations = whitener.apply(rows, kept.shape[1])
            own += innovations @ innovations.T
            kept = rows[:, rows.shape[1] - order :].copy()
        if record.has_free_level and axis.start_positions is None:
            own -= np.outer(own[-1], own[-1]) / own[-1, -1]
        products += own[:-1, :-1]
    return products


def _pairs(dimension: int) -> tuple[np.ndarray, np.ndarray]:
    return np.triu_indices(dimension, 1)


def _monomials(standard: FloatArray) -> FloatArray:
    """1, z_i, z_i^2, z_i z_j of points (points, dimension)."""
    i, j = _pairs(standard.shape[1])
    return np.concatenate(
        [np.ones((len(standard), 1)), standard, standard**2, standard[:, i] * standard[:, j]], axis=1
    )


def _stencil(dimension: int) -> tuple[FloatArray, FloatArray]:
    """Points (points, dimension) in standard coordinates, the centre first, and what of residuals there (the
    first itself, those of the others less it) gives the coefficients of the monomials, (monomials, points).
    """
    i, j = _pairs(dimension)
    one = np.eye(dimension)
    both = one[i] + one[j]
    points = STEP * np.concatenate([np.zeros((1, dimension)), one, -one, both, -both])
    count = len(i)
    plus, minus = 1 + np.arange(dimension), 1 + dimension + np.arange(dimension)
    plus_both = 1 + 2 * dimension + np.arange(count)
    minus_both = plus_both + count
    found = np.zeros((1 + 2 * dimension + count, len(points)))
    found[0, 0] = 1.0
    linear, square = 1 + np.arange(dimension), 1 + dimension + np.arange(dimension)
    mixed = 1 + 2 * dimension + np.arange(count)
    found[linear, plus], found[linear, minus] = 0.5 / STEP, -0.5 / STEP
    found[square, plus] = found[square, minus] = 0.5 / STEP**2
    found[mixed, plus_both] = found[mixed, minus_both] = 0.5 / STEP**2
    for side in (plus, minus):
        found[mixed, side[i]] = found[mixed, side[j]] = -0.5 / STEP**2
    return points, found
