"""Errors of timing are told from slow ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, SIGMA, STRUCTURE, measured, scale
from numpy import concatenate, cumsum
from numpy.random import default_rng
from scipy.signal import lfilter

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.speed_noise import less_for_tails, signed_speed, speed_noise, speeds
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate, innovations
from bayes_hw.record import Record

SAMPLES = 1500


def fitted(records: list[Record]) -> JointFit:
    response = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    return JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))


def test_jitter_is_seen_beneath_a_slow_disturbance() -> None:
    """The disturbance alone is no jitter, although it is large beside the noise."""
    records = measured((), SAMPLES, (1, 2))
    moves = speeds(fitted(records))
    rng = default_rng(5)
    slow = [20 * SIGMA * lfilter([0.05], [1, -0.95], rng.standard_normal(SAMPLES)) for _ in records]
    windy = [replace(r, y=r.y + s) for r, s in zip(records, slow, strict=True)]
    errors = [4 * d * rng.standard_normal(SAMPLES) for d in moves]
    late = [replace(r, y=r.y + e) for r, e in zip(windy, errors, strict=True)]
    seen = fitted(late)
    found = speed_noise(seen, list(seen.point.residuals))
    assert found.present
    assert abs(found.memory) < 0.3
    calm = fitted(windy)
    assert not speed_noise(calm, list(calm.point.residuals)).present


def test_an_axis_that_turns_within_a_sample_is_in_motion_there() -> None:
    np.testing.assert_allclose(
        signed_speed(np.array([0.0, 3.0, 0.0, -3.0, -3.0])), [3, 3, -3, -(4.5**0.5), 0]
    )


def test_held_readings_are_seen_where_the_axis_turns_within_samples() -> None:
    """A quarter of the readings is a sample old, of an axis that swings with a period of three: their errors
    would stand out where a central difference sees no speed."""
    t = np.arange(SAMPLES)
    shake = 40 * SIGMA * np.sin(2 * np.pi * t / 3) * (1 + np.sin(2 * np.pi * t / 400))
    rng = default_rng(3)
    held = np.concatenate([[0.0], -np.diff(shake)]) * (rng.uniform(size=SAMPLES) < 0.25)
    white = held + SIGMA * rng.standard_normal(SAMPLES)
    for speed, heavy in ((signed_speed(shake), False), (np.gradient(shake), True)):
        variance = SIGMA**2 + 0.25 * speed**2
        assert (less_for_tails(1.0, white / np.sqrt(variance)) < 0.35) is heavy


def test_jumps_while_the_axis_is_fast_are_no_jitter() -> None:
    """A wheel that slips now and then: innovations scatter more where it is fast, with heavy tails."""
    records = measured((), SAMPLES, (1, 2))
    moves = speeds(fitted(records))
    rng = default_rng(8)
    slipped = []
    for r, d in zip(records, moves, strict=True):
        slips = (rng.uniform(size=SAMPLES) < 0.05) & (abs(d) > 0.5 * abs(d).max())
        slipped.append(replace(r, y=r.y + cumsum(slips * 5 * SIGMA * rng.standard_normal(SAMPLES))))
    seen = fitted(slipped)
    found = speed_noise(seen, list(seen.point.residuals))
    white = concatenate(innovations(seen.point))
    assert not found.present
    assert less_for_tails(1.0, white) < 0.7
    assert less_for_tails(1.0, rng.standard_normal(3000)) > 0.9
