"""Weights are centred where least squares puts them, one to one, and with it a hard posterior is easy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import NoiseEstimate, estimate_noise
from bayes_hw.infer.centred_weights import CentredWeights
from bayes_hw.infer.importance import importance_trial
from bayes_hw.infer.laplace import Laplace
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.starting_point import starting_point
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.model.parameters import as_coordinates
from bayes_hw.record import Record


@pytest.fixture(scope="module")
def close_axis(small_axis: HammersteinWiener) -> HammersteinWiener:
    """The small axis with two damped pairs beside each other and a lag, as many zeros as poles."""
    rate = small_axis.sample_rate_hz
    pairs = [mode.pole(rate) for mode in (Mode(2.0, 0.1), Mode(1.0, 0.4), Mode(1.25, 0.5))]
    poles = np.array([1.0, 0.6, *pairs, *np.conj(pairs)])
    zeros = np.array([0.3, 0.5, *(Mode(f, 0.3).pole(rate) for f in (1.1, 1.6, 2.6))])
    zeros = np.concatenate([zeros, zeros[2:].conj()])
    gain = 0.05 * np.prod(1 - poles[1:]).real / np.prod(1 - zeros).real
    return replace(small_axis, linear=LinearBlock(zeros, poles, float(gain), 1), noise_sigma=0.002)


@pytest.fixture(scope="module")
def records(close_axis: HammersteinWiener) -> list[Record]:
    return [measured(close_axis, 1200, seed=1), measured(close_axis, 900, seed=2)]


@pytest.fixture(scope="module")
def noise(close_axis: HammersteinWiener) -> NoiseEstimate:
    return estimate_noise([close_axis.noise_sigma * np.random.default_rng(3).standard_normal(5000)], 0)


@pytest.fixture(scope="module")
def centring(close_axis: HammersteinWiener, records: list[Record], noise: NoiseEstimate) -> CentredWeights:
    axis = AxisParameters(close_axis, "all")
    found = CentredWeights.of(axis, axis.nominal, noise, records)
    assert found is not None
    return found


def scattered(axis: AxisParameters, spread: float, count: int = 40) -> FloatArray:
    """Coordinates (count, parameters) about the nominal ones."""
    middle = as_coordinates(axis.parameters, axis.nominal)
    return middle + spread * np.random.default_rng(3).standard_normal((count, len(middle)))


def test_there_and_back(centring: CentredWeights) -> None:
    plain = scattered(centring.axis, 0.05)
    back, _ = centring.to_plain(centring.from_plain(plain))
    np.testing.assert_allclose(back, plain, rtol=0, atol=1e-8)


def test_jacobian_is_that_of_finite_differences(centring: CentredWeights) -> None:
    """And does not hang on how points are stacked."""
    points = centring.from_plain(scattered(centring.axis, 0.01))
    _, log_jacobian = centring.to_plain(points)
    for point, expected in zip(points[:5], log_jacobian[:5], strict=True):
        steps = 1e-6 * np.eye(len(point))
        columns = (centring.to_plain(point + steps)[0] - centring.to_plain(point - steps)[0]) / 2e-6
        assert np.linalg.slogdet(columns)[1] == pytest.approx(expected, abs=1e-3)
    stacked, again = centring.to_plain(points.reshape(5, 8, -1))
    np.testing.assert_array_equal(again.ravel(), log_jacobian)
    np.testing.assert_array_equal(stacked.reshape(points.shape), centring.to_plain(points)[0])


def test_centre_is_where_least_squares_puts_the_weights(
    centring: CentredWeights, records: list[Record]
) -> None:
    """At poles and a gain moved from those of the estimate: fitted in time to what the estimate answers."""
    axis = centring.axis
    rows = list(centring.rows)
    moved = axis.nominal.copy()
    for name, factor in (
        ("pole_pair1.frequency_hz", 1.05),
        ("mode1.frequency_hz", 0.99),
        ("velocity_gain", 1.01),
    ):
        moved[axis.names.index(name)] *= factor
    point = as_coordinates(axis.parameters, moved)
    point[rows] = 0.0
    centre = centring.to_plain(point)[0][rows]
    moved[rows] = 0.0
    each = np.repeat(moved[:, None], len(rows) + 1, axis=1)
    each[rows, np.arange(1, len(rows) + 1)] = 1.0
    rest, *responses = answers(axis, each, records)
    columns = np.array(responses).T - rest[:, None]
    wanted = answers(axis, axis.nominal[:, None], records)[0] - rest
    fitted = np.linalg.lstsq(columns, wanted, rcond=None)[0]
    shift = np.linalg.norm(columns @ (fitted - axis.nominal[rows]))
    assert np.linalg.norm(columns @ (fitted - centre)) < 0.25 * shift


def answers(axis: AxisParameters, values: FloatArray, records: list[Record]) -> FloatArray:
    """Of G to the limited commands (columns of `values`, all samples)."""
    batch, found = axis.linear_batch(values), []
    real, pairs, direct = batch.residues()
    poles = np.concatenate([batch.real_poles, batch.pair_poles, batch.pair_poles.conj()])
    residues = np.concatenate([real, pairs, pairs.conj()])
    for record in records:
        powers = poles[None] ** np.arange(len(record) - 1)[:, None, None]
        pulse = np.concatenate([direct[None], np.sum(residues * powers, axis=1).real])
        u = np.clip(record.u, -0.8, 1.0)[:, None]
        found.append(signal.fftconvolve(np.repeat(u, pulse.shape[1], axis=1), pulse, axes=0)[: len(u)])
    return np.concatenate(found).T


def test_dominant_parameters_have_no_weights(
    close_axis: HammersteinWiener, records: list[Record], noise: NoiseEstimate
) -> None:
    axis = AxisParameters(close_axis, "conditional")
    assert CentredWeights.of(axis, axis.nominal, noise, records) is None


@pytest.mark.slow
def test_close_poles_are_sampled_well(small_axis: HammersteinWiener) -> None:
    """Two damped pairs beside each other: most proposals of a density fitted in these coordinates are
    accepted; in those of the parameters hardly any are."""
    pairs = [mode.pole(small_axis.sample_rate_hz) for mode in (Mode(1.0, 0.4), Mode(1.25, 0.5))]
    zero = Mode(1.1, 0.3).pole(small_axis.sample_rate_hz)
    poles, zeros = np.array([1.0, *pairs, *np.conj(pairs)]), np.array([0.3, zero, np.conj(zero)])
    gain = float(0.05 * np.prod(1 - poles[1:]).real / np.prod(1 - zeros).real)
    model = replace(
        small_axis, linear=LinearBlock(zeros, poles, gain, 1), dominant_modes=(), noise_sigma=0.002
    )
    records = [measured(model, 400, seed=1)]
    axis = AxisParameters(model, "all")
    origin = starting_point(axis, records, np.random.default_rng(1))
    target = LogPosterior(axis, origin.noise_parameters, records)
    mode, covariance = origin.coordinates, origin.covariance
    mapping = CentredWeights.of(axis, target.values(mode), origin.noise, records)
    assert mapping is not None
    plain = Laplace([(mode, covariance)], [target])
    trials = [
        importance_trial(laplace, np.random.default_rng(2)) for laplace in (plain, plain.carried(mapping))
    ]
    accepted = [trial.plan.expected_acceptance for trial in trials]
    assert accepted[0] < 0.2
    assert accepted[1] > 0.5
