"""A bend keeps volumes, has an exact inverse, and straightens what is curved and nothing else."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.triangular_map import Bend

ROOT = np.array([[2.0, 0.3, 0], [0, 1, 0.4], [0, 0, 0.5]])


def curved(count: int, seed: int) -> FloatArray:
    """x2 bends with the square of x0, x1 with the product of two others."""
    points = np.random.default_rng(seed).standard_normal((count, 3)) @ ROOT
    points[:, 2] += 0.7 * points[:, 0] ** 2
    points[:, 1] += 0.1 * points[:, 0] * points[:, 2]
    return points


def equal(points: FloatArray) -> FloatArray:
    return np.full(len(points), 1 / len(points))


def test_undoing_is_the_inverse_also_far_out() -> None:
    points = curved(3000, 1)
    bend = Bend.fitted(points, equal(points))
    for scale in (1.0, 30.0):
        np.testing.assert_allclose(
            bend.undo(bend.apply(scale * points)), scale * points, rtol=1e-9, atol=1e-8
        )


def test_volumes_are_kept() -> None:
    points = curved(3000, 2)
    bend = Bend.fitted(points, equal(points))
    for point in points[:5]:
        steps = 1e-5 * np.eye(3)
        jacobian = (bend.apply(point + steps) - bend.apply(point - steps)) / 2e-5
        assert abs(np.linalg.det(jacobian)) == pytest.approx(1, rel=1e-6)


def test_far_out_the_shift_is_bounded() -> None:
    """A point a thousand widths out is not thrown a million widths aside."""
    points = curved(3000, 3)
    bend = Bend.fitted(points, equal(points))
    out = 1000 * points[:10]
    farthest = np.abs(bend.apply(points) - points).max()
    assert np.abs(bend.apply(out) - out).max() < 20 * farthest


def test_a_banana_is_straightened() -> None:
    """x1 = x0^2 + noise: after unbending, most of what is left of x1 is the noise."""
    rng = np.random.default_rng(9)
    x0 = rng.standard_normal(20_000)
    points = np.column_stack([x0, x0**2 + 0.3 * rng.standard_normal(20_000), rng.standard_normal(20_000)])
    unbent = Bend.fitted(points, equal(points)).undo(points)
    assert points[:, 1].std() > 1.4
    assert unbent[:, 1].std() < 0.6


def test_several_ridges_are_straightened_at_once() -> None:
    """Two ridges of their own in four coordinates of any units: nine tenths of the largest third moment of
    the white cloud are gone."""
    rng = np.random.default_rng(10)
    z = rng.standard_normal((40_000, 4)) * [3.0, 1.0, 0.5, 0.3]
    z[:, 1] += 0.2 * z[:, 0] ** 2
    z[:, 3] -= 0.8 * z[:, 2] ** 2
    points = z * [1.0, 1e3, 1e-4, 1.0]
    bend = Bend.fitted(points, equal(points))

    def third_moments(x: FloatArray) -> FloatArray:
        white = np.linalg.solve(np.linalg.cholesky(np.cov(x.T)), (x - x.mean(axis=0)).T)
        return np.einsum("in,jn,kn->ijk", white, white, white) / len(x)

    before = np.abs(third_moments(points)).max()
    assert before > 1.0
    assert np.abs(third_moments(bend.undo(points))).max() < 0.1 * before


def test_weights_say_which_points_count() -> None:
    """Points of no weight bend nothing."""
    straight = np.random.default_rng(11).standard_normal((5000, 3)) @ ROOT
    both = np.concatenate([straight, curved(2000, 12)])
    weights = np.concatenate([equal(straight), np.zeros(2000)])
    alone, beside = Bend.fitted(straight, equal(straight)), Bend.fitted(both, weights)
    np.testing.assert_allclose(beside.undo(straight), alone.undo(straight), atol=1e-8)
    assert np.abs(alone.undo(straight) - straight).std() < 0.05


def test_few_points_bend_little() -> None:
    """Of fewer points than products, which least squares would fit exactly: other points of the same normal
    cloud are hardly spread by the bend."""
    points, others = np.random.default_rng(13).standard_normal((2, 60, 12))
    moved = Bend.fitted(points, equal(points)).undo(others)
    assert np.cov(moved.T).trace() < 2.5 * np.cov(others.T).trace()
