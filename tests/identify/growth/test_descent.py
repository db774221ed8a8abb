"""A descent ends at the optimum, where it runs out of numbers, or where no step promises anything."""

from collections.abc import Iterator

import numpy as np
import pytest

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import descend, evaluate, normal_matrix, triangular_factor
from bayes_hw.identify.growth.sensitivity_kernel import WHITENED_AT_ONCE


class Steep:
    """Residuals 1 - slope x of one coordinate, its derivative as large as told."""

    masks = None
    level_shapes: tuple[FloatArray, ...] = (np.zeros(64),)

    def __init__(self, slope: float) -> None:
        self.slope = slope

    def residuals(self, coordinates: FloatArray) -> list[FloatArray]:
        rng = np.random.default_rng(1)
        return [1.0 - np.minimum(self.slope, 1.0) * coordinates[0] + 0.01 * rng.standard_normal(64)]

    def linearise(
        self,
        coordinates: FloatArray,
        overlap: int,  # noqa: ARG002
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        rows = np.stack([np.full(64, self.slope), self.residuals(coordinates)[0]])
        yield rows, 0, None

    def admissible(self, coordinates: FloatArray, previous: FloatArray) -> FloatArray:
        del previous
        return coordinates


def test_a_descent_of_a_line_reaches_its_least_squares() -> None:
    point = descend(Steep(1.0), evaluate(Steep(1.0), np.zeros(1)), 20)
    assert point.coordinates[0] == pytest.approx(1.0, abs=0.01)


@pytest.mark.parametrize("slope", [1e160, 1e300, np.inf, np.nan])
def test_derivatives_beyond_numbers_end_a_descent_where_it_is(slope: float) -> None:
    begun = evaluate(Steep(slope if np.isfinite(slope) else 1.0), np.zeros(1))
    ended = descend(Steep(slope), begun, 20)
    np.testing.assert_array_equal(ended.coordinates, begun.coordinates)


class Counted(Steep):
    """How often residuals were asked for."""

    asked = 0

    def residuals(self, coordinates: FloatArray) -> list[FloatArray]:
        self.asked += 1
        return super().residuals(coordinates)

    def linearise(
        self, coordinates: FloatArray, overlap: int
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        for rows, first, measured in super().linearise(coordinates, overlap):
            self.asked -= 1
            yield rows, first, measured


def test_a_descent_at_its_optimum_tries_no_step_that_promises_nothing() -> None:
    """Damping is not raised until none is left."""
    response = Counted(1.0)
    best = descend(response, evaluate(response, np.zeros(1)), 20)
    response.asked = 0
    ended = descend(response, best, 20)
    np.testing.assert_array_equal(ended.coordinates, best.coordinates)
    assert response.asked == 0


class Sloped(Steep):
    """Two coordinates of sizes that differ by ten decades, and a prior."""

    def prior_precision(self) -> FloatArray:
        return np.array([0.0, 1e-12])

    def linearise(
        self,
        coordinates: FloatArray,  # noqa: ARG002
        overlap: int,  # noqa: ARG002
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        rng = np.random.default_rng(2)
        for _ in range(2):
            rows = rng.standard_normal((3, 40)) * np.array([[1e5], [1e-5], [1.0]])
            rows[1] += 1e-11 * rows[0]
            yield rows, 0, None


def test_the_normal_matrix_is_that_of_the_triangular_factor() -> None:
    response = Sloped(1.0)
    point = evaluate(response, np.array([0.3, 1e3]))
    factor = triangular_factor(response, point)
    np.testing.assert_allclose(normal_matrix(response, point), factor.T @ factor, rtol=1e-9, atol=1e-9)


def test_the_normal_matrix_leaves_out_what_free_levels_explain() -> None:
    response = Sloped(1.0)
    point = evaluate(response, np.array([0.3, 1e3]))
    held = normal_matrix(response, point)
    response.level_shapes = (np.ones(40), np.full(40, 0.5))
    factor, free = triangular_factor(response, point), normal_matrix(response, point)
    np.testing.assert_allclose(free, factor.T @ factor, rtol=1e-9, atol=1e-9)
    assert free[-1, -1] < held[-1, -1]


@pytest.mark.parametrize("order", [1, 7, 8, 21])
def test_innovations_do_not_depend_on_the_blocks_they_are_made_in(order: int) -> None:
    """At the edges of blocks too, and where only what comes later is asked for."""
    rng = np.random.default_rng(order)
    whitener = Whitener.of_partial(rng.uniform(-0.4, 0.4, order))
    rows = rng.standard_normal((2, 2 * WHITENED_AT_ONCE + 37))
    made = whitener.apply(rows)
    predictor = np.concatenate([[1.0], -whitener.coefficients[order]])
    for row, out in zip(rows, made, strict=True):
        np.testing.assert_allclose(out[order:], np.convolve(row, predictor)[order : len(row)], atol=1e-12)
    first = order + 3
    np.testing.assert_allclose(whitener.apply(rows, first), made[:, first:], atol=1e-12)


class Bounded:
    """A line of slope x0 and a coordinate x1 in [-1, 1] that hardly acts at zero and ruins all at a bound."""

    masks = None
    level_shapes = (np.zeros(64),)

    def __init__(self) -> None:
        rng = np.random.default_rng(3)
        self.shown, self.noise = rng.standard_normal(64), 0.01 * rng.standard_normal(64)

    def residuals(self, coordinates: FloatArray) -> list[FloatArray]:
        slope, at = coordinates
        return [(1.0 - slope) * self.shown + self.noise - 1e-9 * at - 5.0 * at**8]

    def linearise(
        self,
        coordinates: FloatArray,
        overlap: int,  # noqa: ARG002
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        slight = np.full(64, 1e-9 + 40.0 * coordinates[1] ** 7)
        yield np.stack([self.shown, slight, self.residuals(coordinates)[0]]), 0, None

    def admissible(self, coordinates: FloatArray, previous: FloatArray) -> FloatArray:
        del previous
        return np.array([coordinates[0], np.clip(coordinates[1], -1.0, 1.0)])


def test_a_coordinate_that_runs_to_its_bound_does_not_hold_the_others_up() -> None:
    """Its step is beyond any sense under every damping, since its column is small."""
    point = descend(Bounded(), evaluate(Bounded(), np.zeros(2)), 20)
    assert point.coordinates[0] == pytest.approx(1.0, abs=0.01)
    assert abs(point.coordinates[1]) < 0.5
