"""Isolated samples far off their neighbours."""

from __future__ import annotations

import numpy as np
from drive_axis import coloured, white

from bayes_hw.gap.glitches import find_glitches


def test_glitches_are_found_and_noise_is_not() -> None:
    e = coloured(2000, 1.0, 0.8, seed=1)
    places = np.array([0, 5, 300, 301, 1500, 1999])
    spoilt = e.copy()
    spoilt[places] += np.array([12, -15, 20, -20, 12, 14])
    clean, masks = find_glitches([e]), find_glitches([spoilt, e])
    assert clean[0].sum() <= 1
    assert set(places) <= set(np.flatnonzero(masks[0]))
    assert masks[0].sum() <= len(places) + 1


def test_slow_bumps_and_steps_are_no_glitches() -> None:
    e = white(1000, 1.0, 2) + np.where(np.arange(1000) > 500, 30.0, 0.0)
    assert find_glitches([e])[0].sum() <= 3


def test_many_far_samples_are_another_distribution() -> None:
    """Nor is anything found where the residual does not move at all."""
    rng = np.random.default_rng(3)
    e = np.where(rng.random(1000) < 0.2, 30 * rng.normal(size=1000), rng.normal(size=1000))
    assert not find_glitches([e])[0].any()
    assert not find_glitches([np.zeros(100)])[0].any()
