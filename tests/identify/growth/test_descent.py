"""A descent that runs out of numbers ends where it is, whatever its response does."""

from collections.abc import Iterator

import numpy as np
import pytest

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.growth.descent import descend, evaluate


class Steep:
    """Residuals 1 - slope x of one coordinate, its derivative as large as told."""

    masks = None
    level_shapes = (np.zeros(64),)

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
