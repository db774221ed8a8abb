"""The leading coefficient where a search may have left out a first sample of the impulse response."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, SIGMA, STRUCTURE, command, record, scale

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.leading_sample import earlier_samples, leading_draws
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


def test_an_earlier_sample_is_estimated_with_its_error() -> None:
    for earlier in (0.0, 0.002):
        mean, covariance = earlier_samples(_fit(earlier), 1)
        assert abs(mean[0] - earlier) < 3.5 * np.sqrt(covariance[0, 0])


def test_the_draws_go_where_the_evidence_is() -> None:
    rng = np.random.default_rng(1)
    found = FOUND + 1e-4 * rng.standard_normal(1000)
    moved = leading_draws(_fit(0.002), found, 1.0, rng)
    assert np.mean(moved == found) < 0.1
    assert abs(np.median(moved) - 0.002) < 0.001
    kept = leading_draws(_fit(0.0), found, 1.0, rng)
    assert np.mean(kept == found) > 0.5
