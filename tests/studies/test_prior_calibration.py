"""The whole pipeline is calibrated, and the check that says so finds likelihoods made wrong on purpose.

A few replicates of a small axis; studies/05_calibration.py runs hundreds.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from unittest.mock import Mock

import numpy as np
import pytest
from calibration_summary import CalibrationSummary, summarize_calibration
from prior_calibration import (
    DRAWS,
    LOG_LIKELIHOOD,
    CalibrationCase,
    calibrate_once,
    calibration_tasks,
    draw_from_prior,
    independent_draws,
    simulated_record,
)
from scipy import stats

from bayes_hw.errors import InputError
from bayes_hw.executor import LocalExecutor
from bayes_hw.identify.noise import stationary_autoregression
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.blocks import DeadZone
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

REPLICATES, WRONG_REPLICATES = 28, 6


@pytest.fixture(scope="module")
def case(small_axis: HammersteinWiener) -> CalibrationCase:
    """Twelve seconds of steps; narrow priors, few walkers: about a second a replicate."""
    held = np.random.default_rng(3).normal(0, 0.9, size=30)
    settings = SamplerSettings(ensembles=2, walkers=24, max_steps=300, target_ess=400.0)
    return CalibrationCase(small_axis, np.repeat(held, 8), prior_width=0.25, settings=settings)


@pytest.fixture(scope="module")
def summaries(case: CalibrationCase) -> dict[str, CalibrationSummary]:
    """All replicates of the tests below, from one pair of processes."""
    cases = {
        "right": (case, REPLICATES),
        "sigma": (replace(case, sigma_factor=1.2), WRONG_REPLICATES),
        "white": (replace(case, partial=(0.9,), fixed_partial=True, assumed_order=0), WRONG_REPLICATES),
    }
    tasks = [
        task
        for seed, (one, count) in enumerate(cases.values(), start=1)
        for task in calibration_tasks(one, count, seed)
    ]
    results = iter(LocalExecutor(2).map(calibrate_once, tasks))
    rng = np.random.default_rng(1)
    return {
        name: summarize_calibration(list(islice(results, count)), rng) for name, (_, count) in cases.items()
    }


@pytest.mark.slow
def test_the_pipeline_is_calibrated(case: CalibrationCase, summaries: dict[str, CalibrationSummary]) -> None:
    """Uniform ranks, and intervals of 50, 80 and 94 % that hold the truth that often, pooled over the axis's
    parameters (four standard errors)."""
    summary = summaries["right"]
    assert summary.calibrated, (summary.worst, summary.p_values)
    assert set(summary.ranks) == {*case.axis.names, *(p.name for p in case.noise()), LOG_LIKELIHOOD}
    for achieved, nominal in zip(summary.axis_coverage(), (0.5, 0.8, 0.94, 0.94), strict=True):
        error = np.sqrt(nominal * (1 - nominal) / (REPLICATES * len(case.axis.names)))
        assert abs(achieved - nominal) < 4 * error
    assert summary.not_white <= 3


@pytest.mark.slow
def test_sigma_off_by_20_percent_is_found(summaries: dict[str, CalibrationSummary]) -> None:
    summary = summaries["sigma"]
    assert not summary.calibrated
    assert summary.worst in ("noise.sigma", LOG_LIKELIHOOD)


@pytest.mark.slow
def test_ignored_correlation_is_found(summaries: dict[str, CalibrationSummary]) -> None:
    """White noise assumed where neighbours correlate by 0.9: few intervals hold, residuals are not white."""
    summary = summaries["white"]
    assert not summary.calibrated, summary.p_values
    assert summary.not_white == WRONG_REPLICATES
    assert summary.axis_coverage()[-1] < 0.8


@pytest.mark.slow
def test_summary_is_plain_data(summaries: dict[str, CalibrationSummary]) -> None:
    plain = json.loads(json.dumps(summaries["right"].to_dict(), allow_nan=False))
    assert plain["calibrated"] is summaries["right"].calibrated
    assert plain["ranks"]["gain"] == summaries["right"].ranks["gain"].tolist()


def test_draws_follow_the_priors(case: CalibrationCase) -> None:
    """Kolmogorov-Smirnov on every parameter; the priors are those of the axis, narrowed."""
    parameters = (*case.axis.parameters, *case.noise())
    rng = np.random.default_rng(4)
    drawn = np.array([draw_from_prior(case.axis, case.noise(), rng) for _ in range(400)])
    probabilities = np.linspace(0.05, 0.95, 19)
    for column, parameter in zip(drawn.T, parameters, strict=True):
        quantiles = parameter.prior.quantile(probabilities)
        below = np.mean(column[:, None] < quantiles, axis=0)
        assert np.max(np.abs(below - probabilities)) < stats.kstwobign.isf(1e-4) / 20


@pytest.mark.parametrize(
    "partial",
    [
        pytest.param((), marks=pytest.mark.slow),
        (0.8,),
        pytest.param((0.6, 0.5), marks=pytest.mark.slow),
        pytest.param((-0.7, 0.3, 0.4), marks=pytest.mark.slow),
    ],
)
def test_simulated_noise_is_stationary_from_its_first_sample(partial: Sequence[float]) -> None:
    """Variances and lag-one correlations at the first samples and late ones are those of the process."""
    rng = np.random.default_rng(5)
    kappa = np.array(partial)
    runs = np.array([stationary_autoregression(12, 2.0, kappa, rng) for _ in range(6000)])
    np.testing.assert_allclose(runs.var(axis=0), 4.0, rtol=0.1)
    correlations = [np.corrcoef(runs[:, k], runs[:, k + 1])[0, 1] for k in (0, 1, 5, 10)]
    np.testing.assert_allclose(correlations, kappa[0] if partial else 0.0, atol=0.06)


@pytest.mark.slow
def test_a_replicate_depends_on_its_seed_alone(case: CalibrationCase) -> None:
    first, second = (calibrate_once(calibration_tasks(case, 3, 6)[2]) for _ in range(2))
    del first["seconds"], second["seconds"]
    assert first == second


def test_record_is_the_model_plus_noise(case: CalibrationCase) -> None:
    truth = draw_from_prior(case.axis, case.noise(), np.random.default_rng(7))
    truth[len(case.axis.names)] = 1e-9
    record = simulated_record(case, truth, np.random.default_rng(8))
    model = case.axis.to_model(truth[: len(case.axis.names)])
    np.testing.assert_allclose(record.y, model.simulate(case.command).y, atol=1e-8)


@pytest.mark.parametrize(("time", "steps"), [(2.2, range(0, 10, 3)), (np.inf, range(4, 10, 5))])
def test_draws_are_one_autocorrelation_time_apart(time: float, steps: range) -> None:
    """Counted back from the last step; a stuck chain still gives enough draws to rank among."""
    sampling = Mock()
    sampling.chain = np.arange(2 * 10 * 40, dtype=np.float64).reshape(2, 10, 40, 1)
    sampling.convergence.autocorrelation_time = np.array([0.4, time])
    draws = independent_draws(sampling)
    assert len(draws) >= DRAWS
    np.testing.assert_array_equal(np.sort(draws, axis=None), np.ravel(sampling.chain[:, list(steps)]))


def test_priors_that_look_at_the_data_are_refused(case: CalibrationCase) -> None:
    with pytest.raises(InputError, match=r"^small axis: .* dead_zone.half_width and noise.sigma above zero$"):
        replace(case, model=replace(case.model, dead_zone=DeadZone(0.0)))
