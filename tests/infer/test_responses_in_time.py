"""Where records begin in motion weights and initial states are centred together, as least squares in time
puts them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import NoiseEstimate, estimate_noise
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.infer.centred_weights import CentredWeights
from bayes_hw.infer.laplace import Laplace
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.starting_point import starting_point
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.blocks import DeadZone
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.model.parameters import as_coordinates
from bayes_hw.record import Record

FIRST = 300
"""Samples that are left out of a record."""


def begun_late(record: Record) -> Record:
    """Without its first samples."""
    t = record.t[FIRST:] - record.t[FIRST]
    return Record(record.name, t, record.u[FIRST:], record.y[FIRST:], record.sample_rate_hz, record.units)


@pytest.fixture(scope="module")
def moving_axis(small_axis: HammersteinWiener) -> HammersteinWiener:
    """The small axis without dead zone, two real poles, a pair, a direct term and three samples of delay."""
    rate = small_axis.sample_rate_hz
    pair, zero = Mode(2.0, 0.1).pole(rate), Mode(2.4, 0.3).pole(rate)
    poles = np.array([1.0, 0.6, 0.95, pair, pair.conjugate()])
    zeros = np.array([0.3, 0.5, 0.9, zero, zero.conjugate()])
    gain = float(0.05 * np.prod(1 - poles[1:]).real / np.prod(1 - zeros).real)
    linear = LinearBlock(zeros, poles, gain, 3)
    return replace(small_axis, linear=linear, dead_zone=DeadZone(0.0), noise_sigma=0.002)


@pytest.fixture(scope="module")
def records(moving_axis: HammersteinWiener) -> list[Record]:
    return [begun_late(measured(moving_axis, samples, seed=samples)) for samples in (550, 500)]


@pytest.fixture(scope="module")
def noise() -> NoiseEstimate:
    return estimate_noise([0.002 * np.random.default_rng(3).standard_normal(5000)], 0)


@pytest.fixture(scope="module")
def centring(moving_axis: HammersteinWiener, records: list[Record], noise: NoiseEstimate) -> CentredWeights:
    axis = AxisParameters(moving_axis, "all", start_positions=np.array([0.3, -0.2]))
    estimate = axis.nominal.copy()
    estimate[axis.names.index("dead_zone.half_width")] = 1e-12
    estimate[list(axis.start_rows)] += np.linspace(-0.2, 0.3, len(axis.start_rows))
    found = CentredWeights.of(axis, estimate, noise, records)
    assert found is not None
    return found


def test_there_and_back(centring: CentredWeights) -> None:
    axis = centring.axis
    middle = as_coordinates(axis.parameters, axis.nominal)
    plain = middle + 0.03 * np.random.default_rng(3).standard_normal((5, 4, len(middle)))
    centred = centring.from_plain(plain)
    back, log_jacobian = centring.to_plain(centred)
    np.testing.assert_allclose(back, plain, rtol=0, atol=1e-8)
    point = centred[0, 0]
    steps = 1e-5 * np.eye(len(point))
    columns = (centring.to_plain(point + steps)[0] - centring.to_plain(point - steps)[0]) / 2e-5
    assert np.linalg.slogdet(columns)[1] == pytest.approx(log_jacobian[0, 0], abs=1e-3)


def test_centre_is_where_least_squares_puts_weights_and_states(
    centring: CentredWeights, records: list[Record]
) -> None:
    """At poles and a gain moved from those of the estimate; all samples are looked at."""
    axis, rows = centring.axis, list(centring.rows)
    assert len(rows) == 2 + 2 + 1 + 2 * (1 + 2 + 2)
    estimate = axis.nominal.copy()
    estimate[axis.names.index("dead_zone.half_width")] = 1e-12
    estimate[list(axis.start_rows)] += np.linspace(-0.2, 0.3, len(axis.start_rows))
    moved = estimate.copy()
    for name, factor in (("mode1.frequency_hz", 0.97), ("velocity_gain", 1.02), ("real_pole2.value", 0.99)):
        moved[axis.names.index(name)] *= factor
    point = as_coordinates(axis.parameters, moved)
    point[rows] = 0.0
    centre = centring.to_plain(point)[0][rows]
    each = np.repeat(moved[:, None], len(rows) + 1, axis=1)
    each[rows] = 0.1
    each[rows, np.arange(1, len(rows) + 1)] += 1.0
    rest, *responses = answers(axis, each, records)
    columns = np.array(responses).T - rest[:, None]
    rest = rest - columns @ np.full(len(rows), 0.1)
    wanted = answers(axis, estimate[:, None], records)[0] - rest
    fitted = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    shift = np.linalg.norm(columns @ (fitted - estimate[rows]))
    assert np.linalg.norm(columns @ (fitted - centre)) < 0.02 * shift


def answers(axis: AxisParameters, values: FloatArray, records: list[Record]) -> FloatArray:
    """Simulated (columns of `values`, all samples)."""
    return np.concatenate(simulated_outputs(axis, values, records), axis=1)


def test_a_pole_takes_weights_and_states_along(moving_axis: HammersteinWiener) -> None:
    """Two damped pairs beside each other under a steady command, where what the axis brings along and what it
    is told look alike: two standard deviations along the line of a pole cost some nats in these coordinates,
    two for a normal distribution, and thousands in those of the parameters."""
    rate = moving_axis.sample_rate_hz
    pair, other = Mode(0.5, 0.4).pole(rate), Mode(0.6, 0.5).pole(rate)
    poles = np.array([1.0, 0.93, pair, pair.conjugate(), other, other.conjugate()])
    gain = float(0.05 * np.prod(1 - poles[1:]).real / 0.5)
    linear = LinearBlock(np.array([0.5]), poles, gain, 1)
    model = replace(moving_axis, linear=linear, dominant_modes=(), noise_sigma=1e-4)
    t = np.arange(FIRST + 200) / rate
    u = 0.4 + 0.02 * np.sin(3 * t) + 0.3 * (t < t[FIRST - 8])
    y = model.simulate(u).y + 1e-4 * np.random.default_rng(5).standard_normal(len(t))
    record = begun_late(Record("late", t, u, y, rate, model.units))
    axis = AxisParameters(model, "all", output_scale=1.0, start_positions=record.y[:1])
    origin = starting_point(axis, [record], np.random.default_rng(1))
    target = LogPosterior(axis, origin.noise_parameters, [record])
    mapping = CentredWeights.of(axis, target.values(origin.coordinates), origin.noise, [record])
    assert mapping is not None
    row = target.names.index("pole_pair1.damping_ratio")
    plain = Laplace([(origin.coordinates, origin.covariance)], [target])
    costs = []
    for laplace in (plain, plain.carried(mapping)):
        mode, covariance = laplace.modes[0]
        along = covariance[row] / np.sqrt(covariance[row, row])
        density = laplace.densities[0](np.stack([mode, mode + 2 * along, mode - 2 * along]))
        costs.append(float(density[0] - density[1:].mean()))
    assert 1.0 < costs[1] < 10.0
    assert costs[0] > 100 * costs[1]
