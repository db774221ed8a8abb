"""Stamps that are off by nearly a third of a step, with holes: every sample finds its place."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.log.time_grid import fit_grid


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2, 3))])
def test_every_stamp_finds_its_place(seed: int) -> None:
    """100 logs of 60 to 130 samples, uniform jitter of 0.3 of a step, one to three samples missing now and
    then; a line from the first sixteen stamps alone loses its way in one of two hundred."""
    rng = np.random.default_rng(seed)
    for _ in range(100):
        k = np.arange(int(rng.integers(60, 130)))
        kept = np.ones(len(k), dtype=np.bool_)
        for start in rng.choice(len(k) - 6, 2, replace=False) + 2:
            kept[start : start + rng.integers(1, 4)] = False
        t = (k + 0.3 * rng.uniform(-1, 1, len(k)))[kept] / 20
        grid = fit_grid(t)
        assert grid is not None
        np.testing.assert_array_equal(grid.places, k[kept] - k[kept][0])
        assert grid.rate_hz == pytest.approx(20, rel=0.01)


def test_stamps_off_every_grid_have_none() -> None:
    t = np.cumsum(np.random.default_rng(1).exponential(1.0, 80))
    assert fit_grid(t) is None


@pytest.mark.parametrize("seed", range(8))
def test_stamps_that_are_early_or_late_by_the_whole_jitter(seed: int) -> None:
    """Each by 0.3 of a step, one way or the other, some rows missing: every row finds its place."""
    rng = np.random.default_rng(seed)
    places = np.flatnonzero(rng.random(600) > 0.05)
    t = (places + 0.3 * rng.choice([-1, 1], len(places))) / 20
    grid = fit_grid(t)
    assert grid is not None
    np.testing.assert_array_equal(grid.places, places - places[0])
