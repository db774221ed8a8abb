"""The state in which a record begins that does not begin at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.validation import START_SHARE
from bayes_hw.infer.posterior import Posterior
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener, Simulation
from bayes_hw.model.kernel import KnownSignals, simulate_batch
from bayes_hw.posing import Start
from bayes_hw.record import Record

FEWEST_START_SAMPLES = 20
MOST_START_SAMPLES = 4000
START_ROUNDS, DRAW_ROUNDS = 5, 2
"""Gauss-Newton rounds at the mean of the draws, and for each draw from there."""

AT_ONCE = 40
"""Draws whose states are sought at a time."""

START_STEP = 1e-4
START_CONDITION = 1e-6


def with_start_state(
    axis: AxisParameters, draws: FloatArray, record: Record
) -> tuple[AxisParameters, FloatArray]:
    """The axis with one record's initial state among its parameters, and their values (parameters, draws).

    Least squares finds a state for each of `draws` (draws, parameters), of which the parameters of other
    records' states are left out, from the first quarter of the record, MOST_START_SAMPLES at most: poles and
    state belong together, and one state for all draws would suit none but their mean.
    """
    one = AxisParameters(
        axis.model,
        axis.free,
        output_scale=axis.output_scale,
        start_positions=np.array([float(record.y[0])]),
        held_poles=axis.held_poles,
    )
    rows = [row for row, name in enumerate(one.names) if name.startswith("start1.")]
    values = np.repeat(one.nominal[:, None], len(draws), axis=1)
    values[: rows[0]] = draws.T[: rows[0]]
    shown = max(round(START_SHARE * len(record)), min(len(record), FEWEST_START_SAMPLES))
    shown = min(shown, MOST_START_SAMPLES)
    centre = values.mean(axis=1, keepdims=True)
    for _ in range(START_ROUNDS):
        centre[rows] += _improvement(one, centre, rows, record, shown)
    values[rows] = centre[rows]
    for begin in range(0, values.shape[1] if len(draws) > 1 else 0, AT_ONCE):
        part = slice(begin, begin + AT_ONCE)
        for _ in range(DRAW_ROUNDS):
            values[rows, part] += _improvement(one, values[:, part], rows, record, shown)
    return one, values


def _improvement(
    axis: AxisParameters, values: FloatArray, rows: list[int], record: Record, shown: int
) -> FloatArray:
    """What least squares on the first `shown` samples adds to the states in `rows`, (rows, draws)."""
    step = START_STEP * axis.output_scale
    trials = np.repeat(values, len(rows) + 1, axis=1)
    for place, row in enumerate(rows, start=1):
        trials[row, place :: len(rows) + 1] += step
    form, delay = axis.modal_form(trials, 0), axis.model.linear.delay_samples
    signals = axis.known_signals(record.known, len(record))
    signals = KnownSignals(np.ascontiguousarray(signals.rows[:, :shown]), signals.through)
    y = simulate_batch(form, record.u[:shown], delay, float(record.u[0]), signals).y
    outputs = y.reshape(values.shape[1], len(rows) + 1, shown)
    measured = record.measured_samples[:shown]
    found = np.empty((len(rows), values.shape[1]))
    for draw, own in enumerate(outputs):
        slopes, left = (own[1:] - own[0]).T / step, record.y[:shown] - own[0]
        found[:, draw] = np.linalg.lstsq(slopes[measured], left[measured], rcond=START_CONDITION)[0]
    return found


def started_as(posterior: Posterior, start: Start) -> Posterior:
    """The posterior for records that begin as `start` says, "free" or "rest"; "auto" leaves it as it is."""
    axis = posterior.axis
    if start == "auto" or (start == "free") == (axis.start_positions is not None):
        return posterior
    structure = len(
        AxisParameters(
            axis.model, axis.free, output_scale=axis.output_scale, held_poles=axis.held_poles
        ).parameters
    )
    positions = np.zeros(1) if start == "free" else None
    other = AxisParameters(
        axis.model,
        axis.free,
        output_scale=axis.output_scale,
        start_positions=positions,
        held_poles=axis.held_poles,
    )
    noise = posterior.values[..., len(axis.parameters) :]
    shape = (*noise.shape[:-1], len(other.parameters) - structure)
    states = np.broadcast_to(other.nominal[structure:], shape)
    values = np.concatenate([posterior.values[..., :structure], states, noise], axis=-1)
    estimate = posterior.point_estimate
    moved = [estimate[:structure], other.nominal[structure:], estimate[len(axis.parameters) :]]
    return replace(posterior, axis=other, values=values, point_estimate=np.concatenate(moved))


def start_of_prediction(asked: Start, found: Start) -> Start:
    """How a record to predict begins: as `asked`; with "auto" free where `found` so, else as sampled."""
    return "free" if asked == "auto" and found == "free" else asked


def simulate_from_motion(model: HammersteinWiener, record: Record) -> Simulation:
    """The noise-free response to a record's command from the state that its first quarter shows."""
    scale = max(float(np.max(np.abs(record.y - record.y[0]))), 1e-300)
    axis = AxisParameters(model, "conditional", output_scale=scale)
    one, values = with_start_state(axis, axis.nominal[None], record)
    form = one.modal_form(values, 0)
    signals = one.known_signals(record.known, len(record))
    found = simulate_batch(form, record.u, model.linear.delay_samples, float(record.u[0]), signals)
    return Simulation(model.saturation(record.u), found.w[0], found.y[0])
