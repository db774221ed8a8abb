"""Coordinates along and across the orbits are those of the freed parameters, and hold where raw ones fail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from identifiability.conftest import swinging

from bayes_hw.identifiability.freed_gains import ASYMMETRIES, FreedGains
from bayes_hw.identifiability.gain_posterior import (
    CHART,
    AlignedPosterior,
    ChartPosterior,
    implied_log_sd,
    sample_freed,
)
from bayes_hw.identifiability.invariance import compare_invariants
from bayes_hw.identifiability.scaling_group import log_monomial
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer.inference import infer
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

NOISE = noise_parameters(NoiseEstimate(0.01, np.array([0.5])), "deg")


@pytest.fixture
def pair(small_axis: HammersteinWiener, swinging_record: Record) -> tuple[LogPosterior, FreedGains]:
    freed = LogPosterior(FreedGains(small_axis), NOISE, [swinging_record])
    return freed, FreedGains(small_axis, ASYMMETRIES)


def test_aligned_coordinates_are_the_invariants(pair: tuple[LogPosterior, FreedGains]) -> None:
    freed, chart = pair
    aligned = AlignedPosterior(freed, chart)
    rng = np.random.default_rng(1)
    start = freed.coordinates(np.array([p.nominal for p in freed.parameters]))
    z = np.insert(start[[*range(6), 8, 9, 10, 11]], 8, np.zeros(2)) + 0.01 * rng.standard_normal((50, 12))
    raw = aligned.raw(z)
    np.testing.assert_allclose(aligned(z), freed(raw))
    values = freed.values(raw)
    for name, exponents in CHART.items():
        expected = log_monomial(exponents, values, freed.names)
        np.testing.assert_allclose(z[:, aligned.names.index(name)], expected, atol=1e-12)
    assert np.linalg.det(aligned.raw(np.eye(12))) == pytest.approx(1.0) or np.linalg.det(
        aligned.raw(np.eye(12))
    ) == pytest.approx(-1.0)


def test_chart_has_the_prior_that_the_freed_parameters_imply(
    pair: tuple[LogPosterior, FreedGains], swinging_record: Record
) -> None:
    """Integrating the freed prior over the orbits by brute force gives the chart's, up to a constant."""
    freed, chart = pair
    in_chart = ChartPosterior(chart, NOISE, [swinging_record], freed.axis)
    aligned = AlignedPosterior(freed, chart)
    start = in_chart.coordinates(np.array([p.nominal for p in in_chart.parameters]))
    points = start + 0.002 * np.random.default_rng(2).standard_normal((4, len(start)))
    orbit = np.linspace(-3, 3, 61)
    a, b = (grid.ravel() for grid in np.meshgrid(orbit, orbit))
    integrals = []
    for point in points:
        z = np.repeat(np.insert(point, 8, np.zeros(2))[None], a.size, axis=0)
        z[:, 8], z[:, 9] = a, b
        level = aligned(z)
        integrals.append(level.max() + np.log(np.sum(np.exp(level - level.max()))))
    difference = in_chart(points) - np.array(integrals)
    np.testing.assert_allclose(difference, difference[0], atol=1e-6)
    assert implied_log_sd("dead_zone.gain_negative", freed.axis.parameters) == pytest.approx(0.7 * np.sqrt(2))


def test_very_precise_records_can_be_sampled(small_axis: HammersteinWiener) -> None:
    """Noise a million times smaller than the output: raw parameters agree along the ridge to seven digits."""
    precise = replace(small_axis, noise_sigma=1e-6)
    record = swinging(precise, 8)
    settings = SamplerSettings(ensembles=2, walkers=32, max_steps=100, target_ess=200)
    first, second = np.random.default_rng(3).spawn(2)
    inference = infer(precise, [record], first, settings=settings)
    runs = sample_freed(inference, [record], second, settings=settings)
    assert compare_invariants(runs.freed, runs.chart).agrees
    assert np.std(np.log(runs.freed.chains("saturation.gain"))) > 0.2
