"""Both models of an identification on records that were not used for it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.cascade import simulate, to_coordinates
from bayes_hw.identify.cascade_fit import scaled_least_squares
from bayes_hw.identify.result import Cascade, Identification, RecordFit
from bayes_hw.posing import at_level
from bayes_hw.record import Record


def fit_percent(measured: FloatArray, simulated: FloatArray) -> float:
    """100 (1 - ||y - y_simulated|| / ||y - mean y||), eq. 14 of the paper; both of shape (samples,).

    100 is a perfect fit, 0 no better than the mean of y, negative worse than it. A constant `measured` has no
    fit: ValueError. Samples where either is NaN do not count.
    """
    known = ~np.isnan(measured - simulated)
    if not known.all():
        measured, simulated = measured[known], simulated[known]
    spread = float(np.linalg.norm(measured - measured.mean()))
    if spread == 0:
        raise ValueError("fit_percent: the measured output is constant")
    return float(100 * (1 - np.linalg.norm(measured - simulated) / spread))


START_SHARE = 0.25
"""Part of a record on which its initial states are estimated when it does not start at rest."""

ROUNDS = 4


def evaluate(identification: Identification, records: Sequence[Record]) -> tuple[RecordFit, ...]:
    """Fit percentages (eq. 14) of both models on `records`, every parameter held.

    When the identification was made with free starts, the initial states of each record are estimated
    first, for both models alike, from the first START_SHARE of it.
    """
    model = identification.model
    return tuple(
        RecordFit(
            record.name,
            _fit(
                record,
                model.simulate(record.u, known=record.known).y
                if model.known
                else simulated(identification.cascade, record),
            ),
            _fit(record, simulated(identification.baseline_cascade, record)),
        )
        for record in records
    )


def _fit(record: Record, outputs: FloatArray) -> float:
    return fit_percent(record.y_or_nan, at_level(outputs, record))


def simulated(cascade: Cascade, record: Record) -> FloatArray:
    """Output of a fitted cascade on one record, shape (samples,); see `evaluate` for its initial states."""
    structure = cascade.structure
    values = replace(cascade.values, starts=np.zeros((1, structure.order)))
    coordinates = to_coordinates(structure, values)
    if not structure.free_start:
        return simulate(structure, coordinates[:, None], [record])[0][0]
    order = structure.order
    used = max(round(START_SHARE * len(record)), min(len(record), 4 * order))
    if structure.integrator:
        coordinates[-order] = record.y[0] + np.sign(record.y[0]) * values.half_width
    scale = max(float(np.ptp(record.y)), 1e-300)
    for _ in range(ROUNDS):
        coordinates[-order:] += _start_correction(cascade, record, coordinates, used, scale)
    return simulate(structure, coordinates[:, None], [record])[0][0]


def _start_correction(
    cascade: Cascade, record: Record, coordinates: FloatArray, used: int, scale: float
) -> FloatArray:
    """One Gauss-Newton step of the initial states, the last `order` coordinates."""
    order = cascade.structure.order
    batch = np.repeat(coordinates[:, None], order + 1, axis=1)
    step = 1e-4 * scale
    batch[-order:, 1:] += step * np.eye(order)
    outputs = simulate(cascade.structure, batch, [record])[0][:, :used]
    slopes = (outputs[1:] - outputs[0]).T / step
    known = record.measured_samples[:used]
    return scaled_least_squares(slopes[known], (record.y[:used] - outputs[0])[known])
