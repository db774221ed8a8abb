"""Noise of Student t inside a descent: its likelihood, and an estimate that rare large errors do not move."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import minimize_scalar
from scipy.signal import lfilter

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.growth.coloured import Whitener, log_likelihood_of_t, t_variance
from bayes_hw.identify.growth.descent import CONVERGED_NATS, descend, evaluate, triangular_factor


@pytest.mark.parametrize("degrees", [1.5, 3.0, 20.0])
def test_the_likelihood_is_scipys_at_its_largest_scale(degrees: float) -> None:
    e = 0.02 * np.random.default_rng(1).standard_t(degrees, 600)

    def minus(log_scale: float) -> float:
        return -float(stats.t.logpdf(e, degrees, scale=np.exp(log_scale)).sum())

    best = minimize_scalar(minus, bounds=(-10, 0), method="bounded", options={"xatol": 1e-9})
    assert log_likelihood_of_t(e**2, degrees) == pytest.approx(-best.fun, abs=1e-4)
    assert 0.5 * np.log(t_variance(e**2, degrees)) == pytest.approx(best.x, abs=1e-3)


def test_many_degrees_of_freedom_are_normal_also_over_holes_and_of_coloured_noise() -> None:
    rng = np.random.default_rng(2)
    e = lfilter([1.0], [1.0, -0.8], rng.standard_normal(500))
    measured = rng.random(500) > 0.1
    for masks in (None, [measured]):
        shown = [e if masks is None else np.where(measured, e, np.nan)]
        normal = Whitener.of_residuals(shown, order=1)
        nearly = Whitener(normal.coefficients, normal.scales, degrees_of_freedom=1e9)
        assert nearly.log_likelihood(shown, masks) == pytest.approx(
            normal.log_likelihood(shown, masks), abs=1e-3
        )


class Slope:
    """Residuals of a line through zero under noise of t, or of a normal distribution."""

    masks = None

    def __init__(self, seed: int, degrees: float) -> None:
        rng = np.random.default_rng(seed)
        self.degrees, self.x = degrees, rng.standard_normal(400)
        self.y = 2.0 * self.x + rng.standard_t(1.2, 400)
        self.level_shapes: tuple[FloatArray, ...] = (np.zeros(400),)

    def residuals(self, coordinates: FloatArray) -> list[FloatArray]:
        return [self.y - coordinates[0] * self.x]

    def noise_of(self, residuals: list[FloatArray], most: int, previous: Whitener | None) -> Whitener:
        del residuals, most, previous
        return Whitener(np.zeros((1, 1)), np.ones(1), degrees_of_freedom=self.degrees)

    def linearise(
        self,
        coordinates: FloatArray,
        overlap: int,  # noqa: ARG002
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        yield np.stack([self.x, self.residuals(coordinates)[0]]), 0, None

    def admissible(self, coordinates: FloatArray, previous: FloatArray) -> FloatArray:
        del previous
        return coordinates


def _estimate(seed: int, degrees: float) -> tuple[float, float]:
    """The slope, and how its error compares with what the derivatives say of it."""
    response = Slope(seed, degrees)
    point = descend(response, evaluate(response, np.zeros(1)), 60)
    factor = triangular_factor(response, point)
    sigma = np.sqrt(point.variance_by(factor))
    return float(point.coordinates[0]), float((point.coordinates[0] - 2.0) * abs(factor[0, 0]) / sigma)


def test_a_descent_under_heavy_tails_finds_what_few_large_errors_hide() -> None:
    """Of noise with hardly a mean, over 160 seeds: errors a small part of least squares', and as large as
    stated. Each is the maximum of the likelihood."""
    heavy = np.array([_estimate(seed, 1.2) for seed in range(160)])
    normal = np.array([_estimate(seed, np.inf)[0] for seed in range(40)])
    assert np.median(np.abs(heavy[:, 0] - 2)) < 0.3 * np.median(np.abs(normal - 2))
    assert np.std(heavy[:, 1]) == pytest.approx(1.0, abs=0.15)
    response = Slope(0, 1.2)

    def minus(slope: float) -> float:
        return -log_likelihood_of_t(response.residuals(np.array([slope]))[0] ** 2, 1.2)

    best = minimize_scalar(minus, bounds=(1, 3), method="bounded", options={"xatol": 1e-9})
    assert minus(heavy[0, 0]) == pytest.approx(best.fun, abs=2 * CONVERGED_NATS)
