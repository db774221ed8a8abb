"""The leading coefficient where a search may have left out a first sample of the impulse response."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, command, record, scale

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.leading_sample import earlier_samples, first_samples, leading_draws
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 1500
FOUND = 0.006
"""Leading coefficient of the axis without the sample before."""


def _fit(earlier: float) -> JointFit:
    """The axis at a delay of two samples, fitted to records that have a further sample before."""
    records, late = [], replace(STRUCTURE, delay_samples=2)
    for seed in (1, 2):
        alone = JointResponse(late, (), [record(np.zeros(SAMPLES), seed)], scale(SAMPLES))
        run = alone.simulate(JointValues(CASCADE), command(SAMPLES, seed))
        noise = SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)
        records.append(record(run.y + run.slope * earlier * run.v + noise, seed))
    response = JointResponse(late, (), records, scale(SAMPLES))
    return JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE)))).descended()


def _beside(first: FloatArray, second: FloatArray | float) -> FloatArray:
    return np.stack(np.broadcast_arrays(first, second), axis=1)


def test_an_earlier_sample_is_estimated_with_its_error() -> None:
    for earlier in (0.0, 0.002):
        mean, covariance = earlier_samples(_fit(earlier), 1)
        assert abs(mean[0] - earlier) < 3.5 * np.sqrt(covariance[0, 0])


def test_nothing_tells_of_it_within_the_dead_zone() -> None:
    """An angle that never leaves the dead zone, as where the drive was off."""
    hidden = replace(CASCADE, half_width=1e3)
    records = [record(SIGMA * np.random.default_rng(4).standard_normal(SAMPLES), 4)]
    response = JointResponse(replace(STRUCTURE, delay_samples=2), (), records, scale(SAMPLES))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(hidden))))
    assert np.isinf(earlier_samples(fit, 1)[1]).all()
    drawn = FOUND + 1e-4 * np.random.default_rng(1).standard_normal(100)
    moved = leading_draws(fit, _beside(drawn, 0.02), 1.0, np.random.default_rng(1))
    assert np.mean(moved == drawn) > 0.9


def test_the_draws_go_where_the_evidence_is() -> None:
    rng = np.random.default_rng(1)
    found = FOUND + 1e-4 * rng.standard_normal(1000)
    samples = _beside(found, 0.02)
    moved = leading_draws(_fit(0.002), samples, 1.0, rng)
    assert np.mean(moved == found) < 0.1
    assert abs(np.median(moved) - 0.002) < 0.001
    kept = leading_draws(_fit(0.0), samples, 1.0, rng)
    assert np.mean(kept == found) > 0.5


def test_a_first_sample_that_may_be_none_leaves_the_second() -> None:
    """At an earlier delay by one, where the true first sample is zero, draws go to the second; where it is
    certain they stay."""
    rng, fit = np.random.default_rng(2), _fit(0.0)
    none = 2e-4 * rng.standard_normal(1000)
    second = FOUND - 0.8 * none
    moved = leading_draws(fit, _beside(none, second), 1.0, rng)
    assert np.mean(np.isclose(moved, FOUND, rtol=1e-2)) > 0.7
    certain = FOUND + 2e-4 * rng.standard_normal(1000)
    assert np.mean(leading_draws(fit, _beside(certain, certain + FOUND), 1.0, rng) == certain) > 0.5


def test_two_samples_that_may_be_none_leave_the_third() -> None:
    """At a delay that is two samples short; a second sample that is not zero stays where the first one is."""
    rng = np.random.default_rng(3)
    first, second = 2e-4 * rng.standard_normal((2, 1000))
    third = FOUND - 0.8 * first + 0.5 * second
    moved = leading_draws(_fit(0.0), np.stack([first, second, third], axis=1), 1.0, rng)
    assert np.mean(np.isclose(moved, FOUND, rtol=1e-2)) > 0.5
    samples = np.stack([first, FOUND + 2e-4 * rng.standard_normal(1000), third], axis=1)
    assert np.mean(np.isclose(leading_draws(_fit(0.0), samples, 1.0, rng), samples[:, 1], rtol=0.05)) > 0.7


def test_the_first_samples_are_those_of_the_impulse_response() -> None:
    values = JointValues(CASCADE)
    response = JointResponse(replace(STRUCTURE, delay_samples=0), (), [], scale(SAMPLES))
    w = response.simulate(values, np.r_[0.1, np.zeros(5)]).w / 0.1
    at = int(np.flatnonzero(w)[0])
    assert first_samples(values) == pytest.approx(w[at : at + 3], rel=1e-9)
