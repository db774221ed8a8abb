"""Rounding steps, repeats and glitches that were put in are found, and none where there are none."""

from __future__ import annotations

import numpy as np
from joint_axis import measured, record
from scipy.signal import lfilter

from bayes_hw.gap.joint.noise.reading_faults import (
    glitches,
    repeats,
    rounded_motion,
    rounding_step,
)


def test_a_rounding_step_is_read_off_the_lattice() -> None:
    y = measured((), 800, (1,))[0].y
    found = rounding_step([record(0.0137 * np.round(y / 0.0137), 1)])
    assert found is not None
    assert abs(found / 0.0137 - 1) < 1e-6
    assert rounding_step([record(y, 1)]) is None


def test_rounding_beneath_noise_is_told_from_noise_and_from_a_wave() -> None:
    """Its step is found, from an angle that is a little off too; neither white nor coloured noise, nor a wave
    of another size, is called so."""
    rng = np.random.default_rng(11)
    angle = 3.0 * np.sin(np.linspace(0, 19, 6000)) + np.linspace(0, 2.0, 6000)
    noise, step = 0.01 * rng.standard_normal(6000), 0.043
    shown = step * np.round((angle + 0.3 * step) / step)
    rounded = shown - angle + noise
    found = rounded_motion([rounded], [angle + 0.1 * step * np.sin(np.linspace(0, 3, 6000))], 0.015)
    assert found is not None
    assert abs(found.step / step - 1) < 0.01
    assert found.nats > 300
    coloured = lfilter([1.0], [1.0, -0.9], noise)
    wave = 0.04 * np.sin(2 * np.pi * angle / step) + noise
    for other in (noise, coloured, wave):
        assert rounded_motion([other], [angle], float(np.std(other))) is None
    assert rounded_motion([noise], [np.zeros(6000)], 0.01) is None


def test_repeats_of_a_moving_axis() -> None:
    rng = np.random.default_rng(3)
    y = np.arange(500.0) + 0.1 * rng.standard_normal(500)
    held = rng.random(500) < 0.1
    held[0] = False
    shown = y[np.maximum.accumulate(np.where(held, 0, np.arange(500)))]
    np.testing.assert_array_equal(repeats(shown, np.ones(500), 0.1), held)
    assert not repeats(y, np.ones(500), 0.1).any()


def test_repeats_that_chance_allows_are_none() -> None:
    """Of readings rounded more finely than their noise, at rest and slowly moving; held ones among them
    are."""
    rng = np.random.default_rng(7)
    step = np.where(np.arange(4000) < 2000, 0.0, 0.5)
    y = 0.5 * np.round((np.cumsum(step) + rng.standard_normal(4000)) / 0.5)
    assert np.mean(np.diff(y) == 0) > 0.1
    assert not repeats(y, step, 1.0).any()
    held = rng.random(4000) < 0.3
    held[0] = False
    shown = y[np.maximum.accumulate(np.where(held, 0, np.arange(4000)))]
    assert repeats(shown, step, 1.0)[held].all()


def test_glitches_are_counted_and_noise_is_not() -> None:
    rng = np.random.default_rng(4)
    e = rng.standard_normal(3000)
    assert not glitches([e]).present
    hit = np.arange(50, 3000, 100)
    e[hit] += 12.0
    found = glitches([e])
    assert found.present
    assert found.masks[0][hit].all()
    assert found.count <= len(hit) + 2


def test_what_rounding_does_to_an_axis_at_rest_is_no_glitch() -> None:
    """A reading that jumps a step now and then departs by many times the usual; no less than the deviation of
    rounding is taken for that."""
    e = np.zeros(3000)
    e[np.arange(50, 3000, 100)] = 1.0
    e += 1e-3 * np.random.default_rng(5).standard_normal(3000)
    assert glitches([e]).present
    assert not glitches([e], 1.0 / np.sqrt(12)).present
