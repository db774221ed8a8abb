"""Noise paths have the spread and the correlation that they are asked for."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.control.design import noise_paths


def test_spread_and_correlation() -> None:
    paths = noise_paths(np.array([0.5, 2.0]), np.array([[0.6, -0.3]]), 40_000, np.random.default_rng(1))
    assert paths.std(axis=1) == pytest.approx([0.5, 2.0], rel=0.03)
    for path, correlation in zip(paths, (0.6, -0.3), strict=True):
        assert np.corrcoef(path[1:], path[:-1])[0, 1] == pytest.approx(correlation, abs=0.02)


def test_white_noise_has_no_coefficients() -> None:
    paths = noise_paths(np.ones(3), np.zeros((0, 3)), 100, np.random.default_rng(1))
    assert paths.shape == (3, 100)
