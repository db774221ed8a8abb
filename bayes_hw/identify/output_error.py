"""Output-error estimation of the whole cascade: least squares on the simulated output.

Gauss-Newton (scipy's trust-region reflective variant) in the unbounded coordinates of the parameters; the
Jacobian is taken by central differences, all columns in one call of the compiled kernel.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.identify.holes import whitened_over_holes, with_holes
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.kernel import KnownSignals, simulate_batch
from bayes_hw.model.parameters import as_coordinates, as_values
from bayes_hw.record import Record

DIFFERENCE_STEP = 1e-6
SETTLED_NATS = 1e-3
"""A step that gains less of the logarithm of the likelihood of white noise is the last."""
COORDINATE_LIMIT = 12.0
"""A coordinate may move this far from its start; an insensitive one stops there instead of overflowing."""


@dataclass(frozen=True, eq=False)
class OutputErrorFit:
    """One least-squares estimate.

    `values` and `coordinates` (parameters,); `residuals` (all samples,) measured minus simulated, unwhitened,
    NaN where nothing was measured;
    `information` (parameters, parameters) is J^T J of the weighted residuals in coordinates, prior excluded;
    `sum_of_squares` of the weighted residuals.
    """

    values: FloatArray
    coordinates: FloatArray
    residuals: FloatArray
    information: FloatArray
    sum_of_squares: float

    @property
    def samples(self) -> int:
        """That were measured."""
        return int(np.count_nonzero(~np.isnan(self.residuals)))

    @property
    def plain_sum_of_squares(self) -> float:
        """Of the unwhitened residual, output units squared."""
        known = self.residuals[~np.isnan(self.residuals)]
        return float(known @ known)

    @property
    def rms(self) -> float:
        """Root mean square of the unwhitened residual, output units."""
        return float(np.sqrt(self.plain_sum_of_squares / self.samples))


def simulated_outputs(
    axis: AxisParameters,
    values: FloatArray,
    records: Sequence[Record],
    signals: Sequence[KnownSignals] | None = None,
) -> list[FloatArray]:
    """y of every record for each column of `values` (parameters, walkers): arrays (walkers, samples).

    `signals` are the `known_signals` of the records, where they were computed before.
    """
    outputs = []
    signals = known_signals(axis, records) if signals is None else signals
    for number, record in enumerate(records):
        form = axis.modal_form(values, number)
        before = 0.0 if axis.start_positions is None else float(record.u[0])
        delay = axis.model.linear.delay_samples
        outputs.append(simulate_batch(form, record.u, delay, before, signals[number]).y)
    return outputs


def known_signals(axis: AxisParameters, records: Sequence[Record]) -> list[KnownSignals]:
    """Of the known inputs of the model under every record. Raises InputError where one lacks a column."""
    return [axis.known_signals(record.known, len(record)) for record in records]


def whitened(
    residuals: FloatArray, autoregression: FloatArray, measured: BoolArray | None = None
) -> FloatArray:
    """e(k) - sum_i phi_i e(k - i) along the last axis, with e = 0 before the first sample.

    Where samples were not `measured` (samples,), theirs are zero, and those behind them the innovations given
    what was measured, over the ratio of their standard deviation to that of the others.
    """
    order, samples = len(autoregression), residuals.shape[-1]
    rows = np.ascontiguousarray(residuals).reshape(-1, samples)
    result = rows.copy()
    _whiten(rows, autoregression, result)
    if measured is None:
        return result.reshape(residuals.shape)
    predictors = np.zeros((order + 1, max(order, 1)))
    for known in range(1, order + 1):
        predictors[known, :known] = autoregression[:known]
    whitened_over_holes(rows, measured, predictors, np.ones(order + 1), result)
    return result.reshape(residuals.shape)


@compiled(nogil=True)
def _whiten(rows, autoregression, result):  # type: ignore[no-untyped-def]
    """Take from `result` (n, samples) what the autoregression (p,) predicts of `rows` (n, samples)."""
    for number in range(len(rows)):
        row, own = rows[number], result[number]
        for lag in range(1, len(autoregression) + 1):
            coefficient = autoregression[lag - 1]
            for k in range(lag, len(row)):
                own[k] -= coefficient * row[k - lag]


def fit_output_error(
    axis: AxisParameters,
    records: Sequence[Record],
    start: FloatArray,
    *,
    autoregression: FloatArray | None = None,
    sigma: float = 1.0,
    prior: bool = False,
    max_evaluations: int = 60,
) -> OutputErrorFit:
    """Minimise sum ((y - y_simulated) whitened by `autoregression` / sigma)^2 from the values `start`.

    The level of a record that does not count from zero is estimated with the rest: the residuals are less it.
    With `prior`, each coordinate is also drawn towards its prior (its median and half the width of its
    central 68 %): then `sigma` must be the standard deviation of the innovations, output units.
    """
    coefficients = np.zeros(0) if autoregression is None else autoregression
    parameters = axis.parameters
    centre = as_coordinates(parameters, start)
    prior_mean, prior_sd = prior_scale(axis)
    levels = [_level(axis, record, coefficients) for record in records]
    signals = known_signals(axis, records)

    def weighted(coordinates: FloatArray) -> FloatArray:
        outputs = simulated_outputs(axis, as_values(parameters, coordinates), records, signals)
        parts = [
            _without_level(whitened(record.y - output, coefficients, record.measured) / sigma, level)
            for record, output, level in zip(records, outputs, levels, strict=True)
        ]
        if prior:
            parts.append(((coordinates - prior_mean[:, None]) / prior_sd[:, None]).T)
        rows = np.concatenate(parts, axis=1)
        if not np.isfinite(rows).all():
            np.nan_to_num(rows, copy=False, nan=1e6, posinf=1e6, neginf=-1e6)
        return rows

    def residual(coordinates: FloatArray) -> FloatArray:
        return weighted(coordinates[:, None])[0]

    def jacobian(coordinates: FloatArray) -> FloatArray:
        steps = np.eye(len(coordinates)) * DIFFERENCE_STEP
        both = np.concatenate([coordinates[:, None] + steps, coordinates[:, None] - steps], axis=1)
        rows = weighted(both)
        half = len(coordinates)
        return ((rows[:half] - rows[half:]) / (2 * DIFFERENCE_STEP)).T

    solution = least_squares(
        residual,
        centre,
        jac=jacobian,
        x_scale="jac",
        bounds=(centre - COORDINATE_LIMIT, centre + COORDINATE_LIMIT),
        max_nfev=max_evaluations,
        xtol=1e-10,
        ftol=2 * SETTLED_NATS / sum(len(record) for record in records),
        gtol=1e-10,
    )
    coordinates = np.asarray(solution.x, dtype=np.float64)
    values = as_values(parameters, coordinates)
    outputs = simulated_outputs(axis, values[:, None], records)
    residuals = np.concatenate(
        [
            with_holes(levelled(axis, record, record.y - output[0], coefficients), record.measured)
            for record, output in zip(records, outputs, strict=True)
        ]
    )
    samples = residuals.size
    slopes = np.asarray(solution.jac)[:samples]
    weights = np.asarray(solution.fun)[:samples]
    return OutputErrorFit(values, coordinates, residuals, slopes.T @ slopes, float(weights @ weights))


def levelled(
    axis: AxisParameters, record: Record, residual: FloatArray, autoregression: FloatArray
) -> FloatArray:
    """The residual (samples,) less its level by generalised least squares, where the record's is free.

    Where the initial states are free they hold it.
    """
    level = _level(axis, record, autoregression)
    if level is None:
        return residual
    white = whitened(residual[None], autoregression, record.measured)[0]
    return residual - float(white @ level) / float(level @ level)


def _level(axis: AxisParameters, record: Record, autoregression: FloatArray) -> FloatArray | None:
    """What a level of one is after whitening (samples,); None where the record's is not free."""
    if not record.has_free_level or axis.start_positions is not None:
        return None
    return whitened(np.ones((1, len(record))), autoregression, record.measured)[0]


def _without_level(rows: FloatArray, level: FloatArray | None) -> FloatArray:
    """Rows (walkers, samples) less what of them a level explains."""
    if level is None:
        return rows
    return rows - np.outer(rows @ level / (level @ level), level)


def prior_scale(axis: AxisParameters) -> tuple[FloatArray, FloatArray]:
    """Median and half the central 68 % of every prior, in coordinates."""
    quantiles = np.stack(
        [
            p.transform.to_coordinate(p.prior.quantile(np.array([0.1587, 0.5, 0.8413])))
            for p in axis.parameters
        ]
    )
    return quantiles[:, 1], np.abs(quantiles[:, 2] - quantiles[:, 0]) / 2
