"""The level that a record counts from is integrated out exactly, and the parameters do not take it up."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy import integrate
from simulated_records import measured

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.holes import Holes
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.identify.output_error import fit_output_error
from bayes_hw.infer.log_posterior import LogPosterior, integrated, shifted
from bayes_hw.infer.noise import log_likelihood, noise_parameters
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.kernel import LaggedSums
from bayes_hw.model.parameters import as_coordinates
from bayes_hw.posing import posed
from bayes_hw.record import Record

RNG = np.random.default_rng(4)
SAMPLES, ORDER = 60, 2
RESIDUALS = np.convolve(RNG.standard_normal(SAMPLES + 1), [1.0, 0.6])[1 : SAMPLES + 1] + 0.4
SIGMA, PARTIAL = np.array([1.1]), np.array([[0.5], [-0.2]])


@pytest.mark.parametrize("missing", [[], [10, 11, 40]])
def test_the_integral_is_that_of_quadrature(missing: list[int]) -> None:
    """With and without samples that were not measured."""
    mask = np.ones(SAMPLES, dtype=np.bool_)
    mask[missing] = False
    holes = Holes.of(mask, ORDER) if missing else None
    near = np.zeros(0, dtype=np.int64) if holes is None else holes.near

    def sums_of(e: FloatArray) -> LaggedSums:
        lagged = np.array([[e[lag:] @ e[: SAMPLES - lag]] for lag in range(ORDER + 1)])
        ends = e[:ORDER, None], e[SAMPLES - ORDER :, None]
        return LaggedSums(lagged, *ends, e[near][:, None], np.array([[e.sum()]]))

    sums = sums_of(RESIDUALS)

    def at(level: float) -> float:
        direct = sums_of(RESIDUALS - level)
        moved = shifted(sums, SAMPLES, np.array([level]))
        for one, other in zip(direct, moved, strict=True):
            np.testing.assert_allclose(one, other, atol=1e-10)
        return float(log_likelihood(direct, SAMPLES, SIGMA, PARTIAL, holes)[0])

    top = at(0.4)
    area, _ = integrate.quad(lambda level: np.exp(at(level) - top), -3, 4, epsabs=1e-12)
    likelihood = partial(log_likelihood, samples=SAMPLES, sigma=SIGMA, partial=PARTIAL, holes=holes)
    found = integrated(likelihood, sums, SAMPLES, SIGMA)
    assert found[0] == pytest.approx(top + np.log(area), abs=1e-8)
    far = integrated(likelihood, sums_of(RESIDUALS + 1e4), SAMPLES, SIGMA)
    assert far[0] == pytest.approx(found[0], abs=1e-5)


def test_what_nobody_measured_takes_no_digits(small_axis: HammersteinWiener) -> None:
    """Where a record begins far from its first reading, steps of the likelihood are as smooth as of one that
    was counted from where it began."""
    quiet = replace(small_axis, noise_sigma=1e-5)
    record, mask = measured(quiet, 600, seed=5), np.arange(600) >= 150
    axis, noise = AxisParameters(quiet), noise_parameters(NoiseEstimate(1e-5, np.zeros(0)), "deg")
    values = np.concatenate([axis.nominal, [1e-5]])
    batch = np.repeat(values[:, None], 9, axis=1)
    batch[2] += 1e-9 * np.linspace(-1, 1, 9)
    steps = []
    for shift in (0.0, 700.0):
        one = replace(record, y=record.y + shift, measured=mask, level_sd=800.0)
        height = LogPosterior(axis, noise, [one]).log_likelihood(batch)
        steps.append(np.ptp(np.diff(height, 3)))
    assert max(steps) < 1e-4


def counted(record: Record, shift: float, level_sd: float) -> Record:
    return replace(record, y=record.y + shift, level_sd=level_sd)


def test_where_the_level_is_free_nothing_depends_on_it(small_axis: HammersteinWiener) -> None:
    """Posterior and least squares of the same record counted from another level; held, both change."""
    axis = AxisParameters(small_axis)
    record = measured(small_axis, 600, seed=3)
    sigma = small_axis.noise_sigma
    noise = noise_parameters(NoiseEstimate(sigma, np.array([0.2])), "deg")
    values = np.concatenate([axis.nominal, [sigma, 0.2]])
    heights, fits = {}, {}
    for level_sd in (0.0, 0.1 * sigma):
        for shift in (0.0, 3 * sigma):
            records = [counted(record, shift, level_sd)]
            target = LogPosterior(axis, noise, records)
            heights[level_sd, shift] = float(target(target.coordinates(values)[None])[0])
            fit = fit_output_error(axis, records, axis.nominal, autoregression=np.array([0.2]))
            fits[level_sd, shift] = fit
    free, held = 0.1 * sigma, 0.0
    assert heights[free, 3 * sigma] == pytest.approx(heights[free, 0.0], abs=1e-5)
    assert heights[held, 3 * sigma] < heights[held, 0.0] - 100
    np.testing.assert_allclose(fits[free, 3 * sigma].values, fits[free, 0.0].values, rtol=1e-4)
    assert fits[free, 3 * sigma].rms < 1.02 * fits[held, 0.0].rms < fits[held, 3 * sigma].rms


def test_who_says_that_a_level_is_free(small_axis: HammersteinWiener) -> None:
    """An angle that does not begin at zero is told so by `posed`, an unwrapped one by its reader."""
    record = measured(small_axis, 600, seed=3)
    (moved,) = posed([replace(record, y=record.y + 134.2)]).records
    assert moved.level_sd > 0 and moved.has_free_level
    (same,) = posed([record]).records
    assert same.level_sd == 0 and not same.has_free_level


@pytest.mark.parametrize(("is_free", "least", "most"), [(True, 0.0, 1.5), (False, 2.5, np.inf)])
def test_limits_are_as_far_off_as_their_intervals_say(
    small_axis: HammersteinWiener, is_free: bool, least: float, most: float
) -> None:
    """Root mean square deviation of both limits in standard deviations; farther off where the level is held
    at what half a second of rest tells of it."""
    axis = AxisParameters(small_axis)
    truth = as_coordinates(axis.parameters, axis.nominal)
    innovation = small_axis.noise_sigma * np.sqrt(0.75)
    found = []
    for seed in range(12):
        record = measured(small_axis, 6000, seed=seed, rest=10)
        (record,) = posed([replace(record, y=record.y + 134.2)]).records
        record = record if is_free else replace(record, level_sd=0.0)
        fit = fit_output_error(axis, [record], axis.nominal, autoregression=np.array([0.5]), sigma=innovation)
        deviation = np.sqrt(np.diag(np.linalg.inv(fit.information)))
        found.append(((fit.coordinates - truth) / deviation)[:2])
    assert least < np.sqrt(np.mean(np.square(found))) < most
