"""What moves in jumps is told from what walks, also where a walk meets the dead zone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from joint_axis import CASCADE, SIGMA, STRUCTURE, measured, scale

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.noise.slow_noise import WALK
from bayes_hw.gap.joint.residuals.jumps import jumps, sum_kurtosis
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.search.effect_moves import with_slow_noise
from bayes_hw.identify.growth.descent import evaluate

SAMPLES, HALF_WIDTH = 1500, 0.02


def leaps(rng: np.random.Generator) -> FloatArray:
    """A shift of the angle every few seconds, taken over several samples."""
    steps = 12 * SIGMA * rng.standard_normal(SAMPLES) * (rng.random(SAMPLES) < 0.01)
    return np.cumsum(np.convolve(steps, np.full(6, 1 / 6))[:SAMPLES])


def walk(rng: np.random.Generator) -> FloatArray:
    return np.cumsum(0.4 * SIGMA * rng.standard_normal(SAMPLES))


def fitted(shift: Callable[[np.random.Generator], FloatArray], *, of_axis: bool) -> JointFit:
    """The cascade on records that are off by a shift, of the axis before its dead zone or of the readings."""
    values, rng = JointValues(CASCADE), np.random.default_rng(3)
    plain = JointResponse(STRUCTURE, (), measured((), SAMPLES, (1, 2)), scale(SAMPLES))
    records = []
    for record in plain.records:
        moved, off = plain.simulate(values, record.u), shift(rng)
        w = moved.w + off
        dead = np.sign(w) * np.maximum(np.abs(w) - CASCADE.half_width, 0.0) - moved.y
        records.append(replace(record, y=record.y + (dead if of_axis else off)))
    response = replace(plain, records=records)
    fit = JointFit(response, evaluate(response, response.coordinates(values)))
    return with_slow_noise(fit, WALK)


@pytest.mark.parametrize("of_axis", [False, True], ids=["readings", "axis"])
def test_a_walk_does_not_jump(of_axis: bool) -> None:
    assert not jumps(fitted(walk, of_axis=of_axis))


def test_leaps_of_several_samples_show_in_sums() -> None:
    fit = fitted(leaps, of_axis=False)
    assert jumps(fit)
    assert sum_kurtosis(fit, 6) > 2 * sum_kurtosis(fit, 1)


@pytest.mark.parametrize("leaps_of", [1, 2], ids=["one record", "every record"])
def test_what_happens_once_does_not_come_in_jumps(leaps_of: int) -> None:
    """A single shift of a walk makes the fourth moment of all innovations, and tells nothing of how it moves;
    one in every record does."""
    sizes = iter([20 * SIGMA] * leaps_of + [0.0] * 2)

    def leap(rng: np.random.Generator) -> FloatArray:
        return walk(rng) + next(sizes) * (np.arange(SAMPLES) > SAMPLES // 2)

    assert jumps(fitted(leap, of_axis=False)) == (leaps_of > 1)
