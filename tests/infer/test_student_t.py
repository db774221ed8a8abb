"""Student-t innovations: the likelihood is scipy's, outliers do not move the axis, the ranks are uniform."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from prior_calibration import CalibrationCase
from scipy import stats
from simulated_records import command, measured

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import NoiseEstimate, autoregression_from_partial
from bayes_hw.infer.inference import infer
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import DEGREES, noise_order, noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings, sample
from bayes_hw.infer.starting_point import starting_point
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import Parameter
from bayes_hw.record import Record, Units

QUICK = SamplerSettings(ensembles=2, walkers=64, max_steps=800, target_ess=400)


def robust_target(model: HammersteinWiener, records: list[Record], partial: list[float]) -> LogPosterior:
    estimate = NoiseEstimate(0.012, np.array(partial), 5.0)
    return LogPosterior(AxisParameters(model, output_scale=2.0), noise_parameters(estimate, "deg"), records)


def plain_log_likelihood(e: FloatArray, sigma: float, partial: FloatArray, degrees: float) -> float:
    """scipy's t density of each sample given those before it."""
    scale = sigma * np.sqrt((degrees - 2) / degrees)
    total = 0.0
    for k in range(len(e)):
        known = min(k, len(partial))
        phi = autoregression_from_partial(partial[:known, None])[:, 0]
        prediction = phi @ e[k - known : k][::-1]
        total += stats.t.logpdf(e[k], degrees, prediction, scale * np.sqrt(np.prod(1 - partial[:known] ** 2)))
    return total


@pytest.mark.parametrize("partial", [[], [0.5], [0.4, -0.3, 0.2]])
@pytest.mark.parametrize("samples", [7, 64, 130])
def test_likelihood_is_that_of_scipy(
    small_axis: HammersteinWiener, partial: list[float], samples: int
) -> None:
    """Orders 0, 1 and 3, an outlier of 30 sigma among the samples, walkers each with their own noise."""
    record = measured(small_axis, samples, seed=1)
    y = record.y.copy()
    y[samples // 2] += 0.3
    target = robust_target(small_axis, [replace(record, y=y)], partial)
    nominal = np.array([p.nominal for p in target.parameters])
    rng = np.random.default_rng(2)
    values = nominal[:, None] * (1 + 0.05 * rng.standard_normal((len(nominal), 3)))
    values[-1] = [2.3, 5.0, 80.0]
    found = target.log_likelihood(values)
    n_axis = len(target.axis.parameters)
    for i in range(3):
        e = y - target.axis.to_model(values[:n_axis, i]).simulate(record.u).y
        noise = values[n_axis + 1 : -1, i]
        expected = plain_log_likelihood(e, values[n_axis, i], noise, values[-1, i])
        assert found[i] == pytest.approx(expected, rel=1e-8)


def test_many_degrees_of_freedom_are_normal(small_axis: HammersteinWiener) -> None:
    record = measured(small_axis, 300, seed=3)
    target = robust_target(small_axis, [record], [0.5])
    normal = LogPosterior(target.axis, target.noise[:-1], [record])
    values = np.array([p.nominal for p in target.parameters])[:, None]
    values[-1] = 1e7
    assert target.log_likelihood(values)[0] == pytest.approx(normal.log_likelihood(values[:-1])[0], abs=1e-3)


def with_outliers(model: HammersteinWiener, share: float) -> Record:
    """A share of the innovations is 15 times as large as the others."""
    rng = np.random.default_rng(6)
    u = command(900, rng)
    shocks = rng.standard_normal(900) * np.where(rng.random(900) < share, 15.0, 1.0)
    noise = np.zeros(900)
    for k in range(1, 900):
        noise[k] = 0.5 * noise[k - 1] + model.noise_sigma * np.sqrt(0.75) * shocks[k]
    t = np.arange(900) / model.sample_rate_hz
    return Record("outliers", t, u, model.simulate(u).y + noise, model.sample_rate_hz, Units())


@pytest.mark.slow
def test_outliers_widen_no_interval_of_the_axis(small_axis: HammersteinWiener, tmp_path: Path) -> None:
    """Chosen without being asked for where there are outliers; intervals half as wide as the normal ones,
    the truth inside; the posterior comes back from its files."""
    record = with_outliers(small_axis, 0.04)
    robust = infer(small_axis, [record], np.random.default_rng(1), settings=QUICK)
    normal = infer(small_axis, [record], np.random.default_rng(1), noise="normal", settings=QUICK)
    assert robust.posterior.names[-1] == DEGREES and noise_order(robust.posterior.noise_parameters) >= 1
    assert robust.posterior.converged, robust.posterior.problems
    assert robust.posterior.summaries[DEGREES].mean < 4
    for name, truth in (("gain", small_axis.linear.gain), ("mode1.frequency_hz", 2.0)):
        found, wide = robust.posterior.reported[name], normal.posterior.reported[name]
        assert found.sd < 0.7 * wide.sd
        assert abs(found.mean - truth) < 4 * found.sd
    robust.posterior.write(tmp_path, [record])
    again = Posterior.read(tmp_path)
    assert again.names == robust.posterior.names and again.noise_order == robust.posterior.noise_order


def test_normal_noise_stays_normal(small_axis: HammersteinWiener, small_record: Record) -> None:
    short = SamplerSettings(ensembles=2, walkers=64, max_steps=50)
    found = infer(small_axis, [small_record], np.random.default_rng(1), noise="auto", settings=short)
    assert DEGREES not in found.posterior.names


@pytest.mark.slow
def test_ranks_of_the_truth_are_uniform(small_axis: HammersteinWiener) -> None:
    """Simulation-based calibration: parameters and degrees of freedom from their priors, records with the
    noise that they say, 10 replicates; no parameter's ranks are off at 0.1 per cent after Bonferroni."""
    axis = CalibrationCase(small_axis, np.zeros(300), prior_width=0.25).axis
    estimate = NoiseEstimate(0.01, np.array([0.5]), 6.0)
    noise = noise_parameters(estimate, "deg")
    settings = SamplerSettings(ensembles=2, walkers=32, max_steps=50, target_ess=200)
    shares = []
    for replicate in range(10):
        rng = np.random.default_rng([7, replicate])
        truth = np.array([float(p.prior.quantile(rng.uniform(size=()))) for p in (*axis.parameters, *noise)])
        truth[-3] = 0.01 * np.exp(0.2 * rng.standard_normal())
        record = simulated(axis, truth, 300, rng)
        shares.append(np.mean(_draws(axis, noise, record, settings, rng) < truth, axis=0))
    p_values = [stats.kstest(column, "uniform").pvalue for column in np.delete(np.array(shares), -3, 1).T]
    assert min(p_values) * len(p_values) > 1e-3, p_values


def simulated(axis: AxisParameters, truth: FloatArray, samples: int, rng: np.random.Generator) -> Record:
    """A record with the AR(1) noise of Student-t innovations that `truth` says, from its first sample on."""
    model = axis.to_model(truth[:-3])
    sigma, kappa, degrees = truth[-3:]
    u = command(samples, rng)
    shocks = sigma * np.sqrt((degrees - 2) / degrees) * rng.standard_t(degrees, samples)
    e = np.zeros(samples)
    e[0] = shocks[0]
    for k in range(1, samples):
        e[k] = kappa * e[k - 1] + np.sqrt(1 - kappa**2) * shocks[k]
    t = np.arange(samples) / 20.0
    return Record("replicate", t, u, model.simulate(u).y + e, 20.0, Units())


def _draws(
    axis: AxisParameters,
    noise: tuple[Parameter, ...],
    record: Record,
    settings: SamplerSettings,
    rng: np.random.Generator,
) -> FloatArray:
    start = starting_point(axis, [record], rng, "student-t")
    n_axis = len(axis.parameters)
    target = LogPosterior(axis, noise, [record])
    values = np.concatenate(
        [[start.noise.sigma], start.noise.partial[:1], np.zeros(1 - len(start.noise.partial[:1])), [6.0]]
    )
    coordinates = np.concatenate(
        [
            start.coordinates[:n_axis],
            [float(p.transform.to_coordinate(np.asarray(v))) for p, v in zip(noise, values, strict=True)],
        ]
    )
    covariance = np.diag([*np.zeros(n_axis), 0.05, 0.01, 0.5])
    covariance[:n_axis, :n_axis] = start.covariance[:n_axis, :n_axis]
    found = sample(
        lambda: LogPosterior(axis, noise, [record]), coordinates, covariance, rng, settings=settings
    )
    return target.values(found.chain[:, ::10].reshape(-1, target.dimension))
