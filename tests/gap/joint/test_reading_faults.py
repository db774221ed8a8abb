"""Rounding steps, repeats and glitches that were put in are found, and none where there are none."""

from __future__ import annotations

import numpy as np
from joint_axis import measured, record

from bayes_hw.gap.joint.reading_faults import glitches, repeats, rounding_step


def test_a_rounding_step_is_read_off_the_lattice() -> None:
    y = measured((), 800, (1,))[0].y
    found = rounding_step([record(0.0137 * np.round(y / 0.0137), 1)])
    assert found is not None
    assert abs(found / 0.0137 - 1) < 1e-6
    assert rounding_step([record(y, 1)]) is None


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
