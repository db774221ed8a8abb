"""Samples that were not measured are no part of the likelihood, of residual tests, or of what is
predicted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg, stats
from simulated_records import measured

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.noise import NoiseEstimate, autoregression_from_partial
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.residual_tests import examine_residuals
from bayes_hw.infer.starting_point import starting_point
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record, Units

PARTIALS = ([], [0.5], [0.6, -0.3, 0.2])


def lost(samples: int, share: float, seed: int) -> BoolArray:
    """A mask without a `share` of the samples, the ends and a run of five among them."""
    mask = np.random.default_rng(seed).random(samples) >= share
    mask[[0, 3, samples - 1]] = False
    mask[samples // 2 : samples // 2 + 5] = False
    return mask


def correlations(partial: FloatArray, samples: int) -> FloatArray:
    """Autocorrelation matrix (samples, samples), by the Durbin-Levinson recursion of its own lags."""
    found = [1.0]
    for k in range(1, samples):
        order = min(k, len(partial))
        phi = autoregression_from_partial(partial[:order, None])[:, 0]
        found.append(float(phi @ found[::-1][:order]) if order else 0.0)
    return linalg.toeplitz(found)


def target_of(
    model: HammersteinWiener, records: list[Record], partial: list[float], degrees: float | None
) -> LogPosterior:
    estimate = NoiseEstimate(0.012, np.array(partial), degrees)
    return LogPosterior(AxisParameters(model, output_scale=2.0), noise_parameters(estimate, "deg"), records)


def scattered(target: LogPosterior) -> FloatArray:
    nominal = np.array([p.nominal for p in target.parameters])
    return nominal[:, None] * (1 + 0.05 * np.random.default_rng(2).standard_normal((len(nominal), 3)))


@pytest.mark.parametrize("partial", PARTIALS)
@pytest.mark.parametrize("share", [0.03, 0.4])
def test_normal_likelihood_is_that_of_the_dense_matrix(
    small_axis: HammersteinWiener, partial: list[float], share: float
) -> None:
    """Three walkers with noises of their own; a record of several blocks and one of 60 samples."""
    records = []
    for number, samples in enumerate((190, 60)):
        record = measured(small_axis, samples, seed=number)
        records.append(replace(record, measured=lost(samples, share, number)))
    target = target_of(small_axis, records, partial, None)
    values = scattered(target)
    found = target.log_likelihood(values)
    n_axis = len(target.axis.parameters)
    for i in range(3):
        expected = 0.0
        for record in records:
            known = record.measured_samples
            e = record.y - target.axis.to_model(values[:n_axis, i]).simulate(record.u).y
            own = values[n_axis, i] ** 2 * correlations(values[n_axis + 1 :, i], len(e))[np.ix_(known, known)]
            expected += stats.multivariate_normal(np.zeros(known.sum()), own).logpdf(e[known])
        assert found[i] == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("partial", PARTIALS)
def test_student_t_likelihood_conditions_across_holes(
    small_axis: HammersteinWiener, partial: list[float]
) -> None:
    """Each measured sample given those before it: mean and variance of the dense normal, scipy's t
    density."""
    record = measured(small_axis, 150, seed=1)
    record = replace(record, measured=lost(150, 0.1, 1))
    target = target_of(small_axis, [record], partial, 5.0)
    values = scattered(target)
    values[-1] = [2.3, 5.0, 80.0]
    found = target.log_likelihood(values)
    n_axis = len(target.axis.parameters)
    at = np.flatnonzero(record.measured_samples)
    for i in range(3):
        sigma, degrees = values[n_axis, i], values[-1, i]
        e = record.y - target.axis.to_model(values[:n_axis, i]).simulate(record.u).y
        own = correlations(values[n_axis + 1 : -1, i], len(e))
        expected = 0.0
        for number, k in enumerate(at):
            past = at[:number]
            weights = np.linalg.solve(own[np.ix_(past, past)], own[past, k])
            scale = sigma * np.sqrt((1 - own[k, past] @ weights) * (degrees - 2) / degrees)
            expected += stats.t.logpdf(e[k], degrees, e[past] @ weights, scale)
        assert found[i] == pytest.approx(expected, rel=1e-8)


def test_what_stands_in_a_hole_does_not_matter(small_axis: HammersteinWiener) -> None:
    """A million, NaN or the true angle: the same record, and its angles there lie between their
    neighbours."""
    record = measured(small_axis, 120, seed=4)
    mask = lost(120, 0.05, 4)
    records = [
        replace(record, y=np.where(mask, record.y, fill), measured=mask) for fill in (record.y, 1e6, np.nan)
    ]
    for other in records[1:]:
        np.testing.assert_array_equal(other.y, records[0].y)
    assert records[0].y[61] == pytest.approx(np.interp(61, [59, 65], record.y[[59, 65]]))


def test_mode_moves_by_no_more_than_the_lost_information(small_axis: HammersteinWiener) -> None:
    """Three records, 3 % lost of each: squares of the moves over the difference of the covariances, of
    limits, half width and gain, do not exceed the 99.9 % point of chi-squared; widths grow by a tenth at
    most."""
    squares, count = 0.0, 0
    for seed in range(3):
        record = measured(small_axis, 900, seed)
        axis = AxisParameters(small_axis, output_scale=2.0)
        mask = np.random.default_rng(seed).random(900) >= 0.03
        complete = starting_point(axis, [record], np.random.default_rng(1))
        less = starting_point(axis, [replace(record, measured=mask)], np.random.default_rng(1))
        assert len(complete.noise.partial) == len(less.noise.partial)
        rows = slice(0, 4)
        widths = np.diag(less.covariance)[rows], np.diag(complete.covariance)[rows]
        assert np.all(widths[0] < 1.1 * widths[1])
        lost_width = np.maximum(widths[0] - widths[1], 0.01 * widths[1])
        squares += float(np.sum((less.coordinates - complete.coordinates)[rows] ** 2 / lost_width))
        count += 4
    assert squares < stats.chi2.ppf(0.999, count)


@pytest.mark.slow
def test_residual_tests_hold_their_level_with_holes() -> None:
    """First-order noise with a tenth not measured, 120 records: each test at 1 % fails for 1 % of them,
    within the binomial; of a wrong coefficient whiteness fails for nearly all."""
    rng = np.random.default_rng(3)
    failed, wrong = np.zeros(4), 0
    for _ in range(120):
        e = rng.standard_normal(600)
        for k in range(1, len(e)):
            e[k] += 0.6 * e[k - 1]
        u = np.repeat(rng.standard_normal(60), 10)
        record = Record("r", np.arange(600) / 20, u, e, 20.0, Units(), measured=rng.random(600) >= 0.1)
        tests = examine_residuals(
            [record], [np.where(record.measured_samples, e, np.nan)], np.array([0.6])
        ).tests
        failed += [not test.passed for test in tests]
        other = examine_residuals([record], [np.where(record.measured_samples, e, np.nan)], np.array([0.2]))
        wrong += not other.white
    assert np.all(failed <= stats.binom.ppf(0.9999, 120, 0.02)), failed
    assert wrong > 115
