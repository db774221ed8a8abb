"""Sampling starts at the mode of the posterior, with nearly its covariance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from drawn_posterior import posterior_of
from scipy import signal
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import NoiseEstimate, estimate_noise, samples_worth_one
from bayes_hw.identify.several_starts import fit_from_several_starts
from bayes_hw.infer.inference import axis_for, residual_report
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.starting_point import (
    CARRIED,
    _hides_misfit,
    noise_covariance,
    split_by_record,
    starting_point,
)
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record, Units


def negative_hessian(posterior: LogPosterior, centre: FloatArray, step: FloatArray) -> FloatArray:
    """By central differences with steps (parameters,)."""
    n = len(centre)
    shifts = np.diag(step)
    hessian = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            corners = [centre + a * shifts[i] + b * shifts[j] for a in (1, -1) for b in (1, -1)]
            values = posterior(np.array(corners))
            hessian[i, j] = (values[0] - values[1] - values[2] + values[3]) / (4 * step[i] * step[j])
    return -hessian


def test_mode_and_covariance_of_the_posterior(small_axis: HammersteinWiener) -> None:
    """From a nominal model 10 % off: less than half a posterior width from the mode in every eigendirection,
    and the covariance within a factor of 1.5 of the inverse Hessian there."""
    records = [measured(small_axis, 1500, seed=11), measured(small_axis, 900, seed=12)]
    axis = AxisParameters(small_axis, output_scale=2.0)
    found = starting_point(axis, records, np.random.default_rng(1))
    posterior = LogPosterior(axis, found.noise_parameters, records)
    step = 0.1 * np.sqrt(np.diag(found.covariance))
    hessian = negative_hessian(posterior, found.coordinates, step)
    forward, backward = (posterior(found.coordinates + sign * np.diag(step)) for sign in (1, -1))
    newton = np.linalg.solve(hessian, (forward - backward) / (2 * step))
    assert newton @ hessian @ newton < len(newton) * 0.5**2
    root = np.linalg.cholesky(found.covariance)
    ratios = np.linalg.eigvalsh(root.T @ hessian @ root)
    assert ratios.min() > 1 / 1.5**2 and ratios.max() < 1.5**2
    assert found.starts.agreeing >= 3
    assert found.noise.order == 1
    assert found.noise.partial[0] == pytest.approx(0.5, abs=0.08)
    assert found.noise.sigma == pytest.approx(0.01, rel=0.1)


@pytest.mark.parametrize(("partial", "factor"), [([], 1.0), ([0.5], 1.25 / 0.75), ([-0.8], 1.64 / 0.36)])
def test_variance_of_log_sigma(partial: list[float], factor: float) -> None:
    """1 / (2 n) for white noise, times (1 + phi^2) / (1 - phi^2) for an AR(1)."""
    noise = NoiseEstimate(1.0, np.array(partial))
    assert noise_covariance(noise, 500)[0, 0] == pytest.approx(factor / 1000, rel=1e-12)


def testnoise_covariance_against_simulation() -> None:
    """Spread of the estimates of 1,000 simulated AR(1) sequences, in coordinates."""
    noise = NoiseEstimate(1.0, np.array([0.6]))
    shocks = np.random.default_rng(3).standard_normal((1000, 900))
    e = signal.lfilter([1.0], [1.0, -0.6], shocks, axis=1)[:, 100:]
    found = [estimate_noise([row], order=1) for row in e]
    coordinates = np.array([[np.log(one.sigma), np.arctanh(one.partial[0])] for one in found])
    np.testing.assert_allclose(np.cov(coordinates.T), noise_covariance(noise, 800), rtol=0.15)


def test_residuals_are_those_of_an_axis_where_the_mean_of_the_draws_is_none(
    small_axis: HammersteinWiener,
) -> None:
    """A tenth of the draws stands elsewhere, as where poles trade places: the rest explains the records."""
    record = measured(small_axis, 1500, seed=11)
    drawn = posterior_of(small_axis)
    values = drawn.point_estimate + 1e-2 * (drawn.values - drawn.point_estimate)
    values[:, ::10, :, list(drawn.names).index("gain")] *= 4
    report = residual_report(replace(drawn, values=values), [record])
    assert rms(report.residuals) < 1.2 * rms([record.y - small_axis.simulate(record.u).y])


def rms(parts: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def test_residuals_are_split_at_the_records(small_axis: HammersteinWiener) -> None:
    records = [measured(small_axis, n, seed=n) for n in (5, 7, 3)]
    parts = split_by_record(np.arange(15.0), records)
    assert [part.tolist() for part in parts] == [[*range(5)], [*range(5, 12)], [*range(12, 15)]]


def test_samples_worth_one_of_an_autoregression() -> None:
    """(1 + phi^2) / (1 - phi^2), and one of white noise."""
    rng = np.random.default_rng(5)
    white = rng.standard_normal(200_000)
    coloured = np.asarray(signal.lfilter([1.0], [1.0, -0.8], white))
    assert samples_worth_one([coloured]) == pytest.approx(1.64 / 0.36, rel=0.05)
    assert samples_worth_one([white]) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("lost", [pytest.param(0.0, marks=pytest.mark.slow), 0.02])
def test_noise_that_would_carry_the_axis_is_not_let(lost: float) -> None:
    """A command that loses a constant against its direction and another always, as friction and a slope take
    it, and next to no noise: from the estimate of plain least squares the start simulates as well as that,
    and a sample counts for less than one."""
    mode = Mode(1.2, 0.08)
    pole = mode.pole(20.0)
    linear = LinearBlock(np.array([0.3]), np.array([1.0, pole, np.conj(pole)]), 0.01, 1)
    model = HammersteinWiener("axis", 20.0, Saturation(-0.5, 0.6), linear, DeadZone(0.01), (mode,))
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-0.4, 0.4, 50), 20)
    y = model.simulate(u + lost * (1 - np.sign(u))).y + 1e-5 * rng.standard_normal(1000)
    record = Record("r", np.arange(1000) / 20.0, u, y, 20.0, Units())
    nominal = axis_for(model, [record], "all", "rest")
    best = fit_from_several_starts(nominal, [record], rng=np.random.default_rng(0)).best
    axis = axis_for(nominal.to_model(best.values), [record], "all", "rest")
    found = starting_point(axis, [record], np.random.default_rng(0))
    target = LogPosterior(axis, found.noise_parameters, [record], found.power)
    values = target.values(found.coordinates)
    error = y - axis.to_model(values[: len(axis.parameters)]).simulate(u).y
    assert np.sqrt(np.mean(error**2)) < CARRIED * best.rms
    assert (found.power < 0.2) == (lost > 0)
    assert (found.power == 1.0) == (lost == 0)
    assert found.noise.order == 0
    whole = LogPosterior(axis, found.noise_parameters, [record]).log_likelihood(values[:, None])
    np.testing.assert_allclose(target.log_likelihood(values[:, None]), found.power * whole, rtol=1e-12)


@pytest.mark.parametrize(
    ("follows", "slow", "hidden"), [(True, True, True), (False, True, False), (True, False, False)]
)
def test_noise_hides_a_misfit_where_its_innovations_follow_the_command(
    follows: bool, slow: bool, hidden: bool
) -> None:
    """Slow errors are predicted in any case; they are the model's where what is left of them follows the
    command, and what is not predicted hides nothing."""
    rng, n = np.random.default_rng(3), 3000
    u = np.repeat(rng.uniform(-1, 1, n // 10), 10)
    shocks = 0.1 * rng.standard_normal(n) + (u if follows else rng.uniform(-1, 1, n))
    e = signal.lfilter([1.0], [1.0, -0.995] if slow else [1.0], shocks)
    record = Record("r", np.arange(n) / 20.0, u, e, 20.0, Units())
    fit: Any = SimpleNamespace(residuals=e)
    assert _hides_misfit(estimate_noise([e], 1 if slow else 0), fit, [record]) is hidden
