"""A limit that the commands hardly reach: the wide plain beyond it is found beside the peak below it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from simulated_records import coloured_noise

from bayes_hw.identify.output_error import fit_output_error, prior_scale
from bayes_hw.infer.improper_tails import onto_plains
from bayes_hw.infer.inference import infer
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.starting_point import (
    along_the_plain,
    covariance_with_prior,
    loosen_flat_directions,
    starting_point,
)
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

ROW = 1


def approaching(model: HammersteinWiener, seed: int, largest: float) -> Record:
    """A smooth command whose peaks, all of slightly different heights, come up to `largest` of the limit."""
    rng = np.random.default_rng(seed)
    t = np.arange(1200) / 20
    envelope = largest * (1 - 0.02 * np.sin(0.31 * t) ** 2)
    u = envelope * model.saturation.upper * np.sin(2 * np.pi * 0.4 * t) - 0.1
    u = np.maximum(u, 0.6 * model.saturation.lower)
    y = model.simulate(u).y + coloured_noise(len(u), model.noise_sigma, 0.5, rng)
    return Record("approaching", t, u, y, 20.0, model.units)


@pytest.mark.parametrize("seed", [1, pytest.param(3, marks=pytest.mark.slow)])
def test_unreached_limit_keeps_its_range(small_axis: HammersteinWiener, seed: int) -> None:
    """The upper limit lies just above all commands: its interval reaches well past the truth."""
    record = approaching(small_axis, seed, 1.05)
    assert record.u.max() < 1.0
    settings = SamplerSettings(ensembles=2, walkers=32, max_steps=100, target_ess=200)
    found = infer(small_axis, [record], np.random.default_rng(seed), settings=settings).posterior
    low, high = found.summaries["saturation.upper"].hdi94
    assert low < 1.0 < high
    assert high > 1.3


def test_a_peak_with_a_small_lead_gives_way_and_a_large_one_does_not(small_axis: HammersteinWiener) -> None:
    record = approaching(small_axis, 4, 1.05)
    axis = AxisParameters(small_axis)
    start = starting_point(axis, [record], np.random.default_rng(4))
    target = LogPosterior(axis, start.noise_parameters, [record])
    prior_sd = np.array([0.3, 0.3, 1.0, 0.3, 0.1, 0.8])
    peak = start.coordinates.copy()
    peak[ROW] = np.log(record.u.max() - 1e-4)
    narrow = np.diag(np.concatenate([(1e-3 * prior_sd) ** 2, np.ones(len(peak) - 6)]))
    rows, moved, _ = onto_plains(target, peak, narrow, prior_sd, 1.0)
    assert ROW in rows
    assert np.exp(moved[ROW]) > 1.1 * record.u.max()
    reached = replace(record, y=small_axis.simulate(np.minimum(record.u, 0.8)).y)
    clipped = peak.copy()
    clipped[ROW] = np.log(0.8)
    assert (
        ROW
        not in onto_plains(
            LogPosterior(axis, start.noise_parameters, [reached]), clipped, narrow, prior_sd, 1.0
        )[0]
    )


@pytest.mark.slow
def test_on_a_plain_others_are_as_sure_as_without_the_limit(small_axis: HammersteinWiener) -> None:
    """Below the largest commands the gain makes up for the limit; beyond them it need not."""
    record = approaching(small_axis, 4, 1.05)
    axis = AxisParameters(small_axis)
    start = starting_point(axis, [record], np.random.default_rng(4))
    target = LogPosterior(axis, start.noise_parameters, [record])
    n_axis, gain = len(axis.names), axis.names.index("gain")
    _, prior_sd = prior_scale(axis)
    coordinates = start.coordinates.copy()
    coordinates[ROW] = np.log(record.u.max() - 1e-4)
    mixed = np.eye(len(coordinates))
    mixed[:n_axis, :n_axis] = np.diag((1e-3 * prior_sd) ** 2)
    mixed[gain, gain] = prior_sd[gain] ** 2
    mixed[ROW, gain] = mixed[gain, ROW] = -0.99 * 1e-3 * prior_sd[ROW] * prior_sd[gain]
    assert loosen_flat_directions(target, coordinates, mixed, prior_sd)
    values = target.values(coordinates)[:n_axis]
    sigma, rho = start.noise.innovation_sigma, start.noise.autoregression
    fit = fit_output_error(axis, [record], values, autoregression=rho, sigma=sigma, prior=True)
    expected = np.sqrt(covariance_with_prior(fit.information, prior_sd)[gain, gain])
    assert np.sqrt(mixed[gain, gain]) == pytest.approx(expected, rel=0.2)
    assert mixed[ROW, ROW] == pytest.approx(0.25 * prior_sd[ROW] ** 2)


def test_a_peak_and_the_plain_beside_it_are_both_kept(small_axis: HammersteinWiener) -> None:
    """Limits that few commands exceed, in steady noise: neither place has nearly all of the posterior."""
    record = approaching(small_axis, 3, 1.05)
    axis = AxisParameters(small_axis)
    start = starting_point(axis, [record], np.random.default_rng(3))
    target = LogPosterior(axis, start.noise_parameters, [record])
    peak = start.coordinates.copy()
    peak[ROW] = np.log(record.u.max() - 1e-4)
    for width, count in ((0.02, 2), (1e-5, 1)):
        covariance = start.covariance.copy()
        covariance[ROW], covariance[:, ROW] = 0.0, 0.0
        covariance[ROW, ROW] = width**2
        assert len(along_the_plain(target, peak, covariance)) == count
