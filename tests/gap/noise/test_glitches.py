"""Isolated samples far off their neighbours."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import coloured, white

from bayes_hw.gap.noise.glitches import FEWEST, Glitches, find_glitches


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


def test_the_likelihood_of_places_and_heights() -> None:
    """That of independent places and of normal heights, both at their own estimates, worked out sample by
    sample; slow motion beneath them does not count as height."""
    heights = np.array([50.0, -40.0, 60.0, -50.0])
    e = 3 * np.sin(np.arange(900) / 90.0) + 0.1 * white(900, 1.0, 8)
    e[[40, 200, 377, 650]] += heights
    found = Glitches.of([e])
    assert found is not None and found.found == 4 and found.rate == 4 / 900
    assert found.height == pytest.approx(np.sqrt(np.mean(np.square([50, 40, 60, 50]))), rel=0.01)
    each = [
        -0.5 * np.log(2 * np.pi * found.height**2) - 0.5 * (h / found.height) ** 2 for h in (50, 40, 60, 50)
    ]
    places_known = 4 * np.log(4 / 900) + 896 * np.log(896 / 900)
    assert found.log_likelihood == pytest.approx(np.sum(each) + places_known, rel=0.01)


def test_too_few_are_no_effect() -> None:
    e = white(900, 1.0, 6)
    e[np.arange(FEWEST - 1) * 200 + 50] += 40.0
    assert Glitches.of([e]) is None


def test_ringing_is_no_glitches() -> None:
    """A burst at a quarter of the sample rate departs from its neighbours' median, many times in a row."""
    k = np.arange(2000)
    burst = 30 * np.exp(-(((k - 900) / 25.0) ** 2)) * np.sin(0.5 * np.pi * k + 0.3)
    assert not find_glitches([white(2000, 1.0, 9) + burst])[0].any()
