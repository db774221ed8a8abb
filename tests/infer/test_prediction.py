"""Predictive bands are the quantiles that they say, and cover new records of the same axis."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from simulated_records import measured

from bayes_hw.errors import InputError
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.prediction import (
    band_coverage,
    band_holds,
    coverage,
    coverage_sentence,
    noisy_quantiles,
    predict,
)
from bayes_hw.infer.start_state import with_start_state
from bayes_hw.infer.starting_point import starting_point
from bayes_hw.model import streaming
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import as_values
from bayes_hw.record import Record


def test_one_draw_gives_normal_quantiles() -> None:
    outputs = np.array([[0.0, 3.0, -50.0]])
    low, high = noisy_quantiles(outputs, np.array([0.2]), 0.94)
    np.testing.assert_allclose(low, outputs[0] + 0.2 * stats.norm.ppf(0.03), rtol=1e-12)
    np.testing.assert_allclose(high, outputs[0] + 0.2 * stats.norm.ppf(0.97), rtol=1e-12)


@pytest.mark.parametrize("spread", [0.01, 1.0, 3.0])
def test_many_draws_agree_with_brute_force(spread: float) -> None:
    """Noise and parameter spread of any ratio: the mixture's distribution function is 3 % and 97 % there, and
    simulated noise finds the same bounds."""
    rng = np.random.default_rng(1)
    outputs = spread * rng.gamma(2.0, size=(200, 6)) * np.array([1.0, -1, 1, -1, 2, 0.1])
    sigma = rng.uniform(0.5, 1.0, 200)
    low, high = noisy_quantiles(outputs, sigma, 0.94)
    for bound, probability in ((low, 0.03), (high, 0.97)):
        reached = stats.norm.cdf((bound - outputs) / sigma[:, None]).mean(axis=0)
        np.testing.assert_allclose(reached, probability, rtol=1e-5)
    noisy = outputs[:, None, :] + sigma[:, None, None] * rng.standard_normal((200, 500, 6))
    brute = np.quantile(noisy.reshape(-1, 6), [0.03, 0.97], axis=0)
    np.testing.assert_allclose([low, high], brute, atol=0.05 * (1 + 2 * spread))


def test_a_beginning_that_was_not_measured_has_the_level_of_its_readings(
    small_axis: HammersteinWiener, small_record: Record
) -> None:
    """For each draw; bands are as wide as the noise, not as what was unknown before any model."""
    axis = AxisParameters(small_axis)
    start = starting_point(axis, [small_record], np.random.default_rng(0))
    mode = as_values((*axis.parameters, *start.noise_parameters), start.coordinates)
    values = np.tile(mode, (1, 40, 1))
    sampled = Posterior(axis, start.noise_parameters, values, np.zeros((1, 40)), mode, True, (), 0.0)
    mask = np.arange(len(small_record)) >= 120
    moved = replace(small_record, y=small_record.y + 7.0, measured=mask, level_sd=9.0)
    found = predict(sampled, moved, np.random.default_rng(1))
    assert abs(float(np.mean((moved.y - found.mean)[mask]))) < 1e-9
    assert np.max(found.upper - found.lower) < 8 * small_axis.noise_sigma
    assert band_coverage(found).achieved > 0.85


def test_two_far_draws() -> None:
    """A distribution with a gap wider than its noise: the probit is far from linear."""
    outputs = np.array([[-5.0], [5.0]])
    low, high = noisy_quantiles(outputs, np.array([0.5, 0.5]), 0.94)
    np.testing.assert_allclose(high, 5 + 0.5 * stats.norm.ppf(0.94), rtol=1e-4)
    np.testing.assert_allclose(low, -high, rtol=1e-6)


def test_coverage_of_independent_samples_is_the_wilson_interval() -> None:
    rng = np.random.default_rng(2)
    inside = (rng.uniform(size=2000) < 0.94).astype(float)
    found = coverage(inside)
    assert found.achieved == inside.mean() and found.agrees
    assert found.effective_samples == pytest.approx(2000, rel=0.15)
    exact = stats.binomtest(int(inside.sum()), 2000).proportion_ci(0.95, "wilson")
    assert found.interval == pytest.approx((exact.low, exact.high), abs=0.002)


def test_coverage_counts_correlated_samples_once() -> None:
    inside = np.repeat((np.random.default_rng(3).uniform(size=200) < 0.9).astype(float), 20)
    found = coverage(inside)
    assert found.effective_samples < 400
    assert found.interval[1] - found.interval[0] > 0.05


@pytest.mark.parametrize("inside", [np.ones(50), np.zeros(50)])
def test_coverage_of_all_or_nothing(inside: np.ndarray) -> None:
    found = coverage(inside)
    assert found.achieved == inside[0]
    assert 0 - 1e-12 <= found.interval[0] < found.interval[1] <= 1 + 1e-12
    assert found.agrees == bool(inside[0])


@pytest.fixture(scope="module")
def posterior(small_axis: HammersteinWiener) -> Posterior:
    """Draws of the Laplace approximation from a long record: near enough to the posterior for bands."""
    training = measured(small_axis, 6000, seed=20)
    axis = AxisParameters(small_axis, output_scale=2.0)
    start = starting_point(axis, [training], np.random.default_rng(1))
    parameters = (*axis.parameters, *start.noise_parameters)
    normal = np.random.default_rng(2).standard_normal((400, len(parameters)))
    coordinates = start.coordinates + normal @ np.linalg.cholesky(start.covariance).T
    values = as_values(parameters, coordinates.T).T.reshape(4, 10, 10, -1)
    mode = as_values(parameters, start.coordinates)
    return Posterior(axis, start.noise_parameters, values, np.zeros((4, 10, 10)), mode, True, (), 0.0)


def test_bands_cover_new_records(posterior: Posterior, small_axis: HammersteinWiener) -> None:
    """94 % and 50 % bands on a held-out record contain the share of y that they promise; the narrower band of
    the parameters alone contains the noise-free output."""
    record = measured(small_axis, 1000, seed=21)
    found = predict(posterior, record, np.random.default_rng(3))
    for nominal in (0.94, 0.5):
        assert band_coverage(found, nominal).achieved == pytest.approx(nominal, abs=0.04)
    assert band_coverage(found).agrees
    inside = (record.y >= found.lower) & (record.y <= found.upper)
    assert band_coverage(found).achieved == pytest.approx(inside.mean(), abs=0.002)
    assert (found.lower <= found.lower_parameters).all()
    assert (found.upper_parameters <= found.upper).all()
    clean = small_axis.simulate(record.u).y
    assert np.mean((clean >= found.lower_parameters - 1e-9) & (clean <= found.upper_parameters + 1e-9)) > 0.8
    assert found.fit_percent > 90


def test_coverage_is_said_in_one_sentence(posterior: Posterior, small_axis: HammersteinWiener) -> None:
    """Its numbers are those of the bands; samples that were not measured count nowhere."""
    whole = measured(small_axis, 1000, seed=21)
    record = replace(whole, measured=np.arange(len(whole)) % 7 != 3)
    found = predict(posterior, record, np.random.default_rng(3))
    said = coverage_sentence(record, found.mean, band_holds(found))
    assert f"fit {found.fit_percent:.1f} %" in said
    assert f"hold {100 * band_coverage(found).achieved:.1f} % of the samples" in said


def test_a_wrong_noise_level_is_seen_in_the_coverage(
    posterior: Posterior, small_axis: HammersteinWiener
) -> None:
    noisier = measured(replace(small_axis, noise_sigma=0.013), 1000, seed=22)
    assert not band_coverage(predict(posterior, noisier, np.random.default_rng(3))).agrees


def test_rate_mismatch(posterior: Posterior, small_record: Record) -> None:
    with pytest.raises(InputError, match=r"50 Hz.*--resample 20"):
        predict(posterior, replace(small_record, sample_rate_hz=50.0), np.random.default_rng(1))


@pytest.mark.parametrize("position", [5.0, -3.0])
def test_free_start_begins_where_the_record_does(small_axis: HammersteinWiener, position: float) -> None:
    """A posterior with free initial conditions predicts a record that starts elsewhere."""
    axis = AxisParameters(small_axis, output_scale=2.0, start_positions=np.array([0.1]))
    noise = noise_parameters(NoiseEstimate(0.01, np.zeros(0)), "deg")
    nominal = np.array([p.nominal for p in (*axis.parameters, *noise)])
    values = np.tile(nominal, (1, 2, 5, 1))
    posterior = Posterior(axis, noise, values, np.zeros((1, 2, 5)), nominal, True, (), 0.0)
    record = measured(small_axis, 1000, seed=23, initial_position=position)
    quiet = record.u.copy()
    quiet[:30] = 0.0
    y = small_axis.simulate(quiet, position).y
    found = predict(posterior, replace(record, u=quiet, y=y), np.random.default_rng(1))
    np.testing.assert_allclose(found.mean, y, atol=1e-9)


def test_free_start_without_an_integrator(small_axis: HammersteinWiener, small_record: Record) -> None:
    """No position to hold: the free response of the slow pole is found from the first quarter."""
    poles = small_axis.linear.poles.copy()
    poles[poles == 1.0] = 0.9
    model = replace(small_axis, linear=replace(small_axis.linear, poles=poles))
    axis = AxisParameters(model, output_scale=2.0, start_positions=np.array([0.1]))
    noise = noise_parameters(NoiseEstimate(0.01, np.zeros(0)), "deg")
    nominal = np.array([p.nominal for p in (*axis.parameters, *noise)])
    posterior = Posterior(
        axis, noise, np.tile(nominal, (1, 2, 5, 1)), np.zeros((1, 2, 5)), nominal, True, (), 0.0
    )
    quiet = small_record.u.copy()
    quiet[:30] = 0.0
    y = model.dead_zone(model.simulate(quiet).w + 0.7 * 0.9 ** np.arange(len(quiet)))
    found = predict(posterior, replace(small_record, u=quiet, y=y), np.random.default_rng(1))
    np.testing.assert_allclose(found.mean, y, atol=1e-8)


def test_every_draw_begins_where_its_own_poles_say(small_axis: HammersteinWiener) -> None:
    """Draws of different gains need different states for the same beginning: one state for all would leave
    their errors in it, and the mean of the predictions would be off."""
    (record,) = [measured(small_axis, 600, 11)]
    late = replace(record, t=record.t[150:], u=record.u[150:], y=record.y[150:])
    axis = AxisParameters(small_axis, "all", output_scale=1.0, start_positions=np.array([float(late.y[0])]))
    draws = np.repeat(axis.nominal[None], 30, axis=0)
    row = axis.names.index("velocity_gain")
    draws[:, row] *= 1 + 0.02 * np.random.default_rng(1).standard_normal(30)
    own, values = with_start_state(axis, draws, late)
    outputs = simulated_outputs(own, values, [late])[0][:, :100]
    states = [name for name in own.names if name.startswith("start1.")]
    spread = np.std(values[[own.names.index(name) for name in states]], axis=1)
    assert np.max(spread) > 0
    shared = values.copy()
    for name in states:
        shared[own.names.index(name)] = values[own.names.index(name)].mean()
    one_state = simulated_outputs(own, shared, [late])[0][:, :100]
    errors = [float(np.sqrt(np.mean((late.y[:100] - y) ** 2))) for y in (outputs, one_state)]
    assert errors[0] < errors[1]


def test_bands_do_not_depend_on_where_blocks_end(
    posterior: Posterior, small_record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = predict(posterior, small_record, np.random.default_rng(1))
    monkeypatch.setattr(streaming, "SAMPLES", 64)
    parts = predict(posterior, small_record, np.random.default_rng(1))
    for name in ("mean", "lower", "upper_parameters", "predicted_probability"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name), rtol=1e-9, atol=1e-12)
