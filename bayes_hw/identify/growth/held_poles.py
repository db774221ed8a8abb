"""A descent that leaves real poles where they are.

A real pole of little weight goes anywhere in a descent: to the integrator, or to the Nyquist frequency, where
it fits noise.
"""

from __future__ import annotations

from collections.abc import Iterator

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.descent import Point, evaluate
from bayes_hw.identify.growth.search import Grown


def fitted_with_held_poles(structure: Structure, values: CascadeValues, item: Grown) -> Grown:
    """A cascade that extends `item`, descended from `values` with every real pole where it is."""
    records, point = item.response.records, item.point
    held = _RealPolesHeld(structure, records)
    start: Point = evaluate(held, held.coordinates(values), point.whitener, point.most_noise)
    fitted = Grown(held, start).descended()
    return Grown.at(structure, fitted.values, records, point.most_noise)


class _RealPolesHeld(CascadeResponse):
    """A response whose real poles no descent moves."""

    def linearise(
        self, coordinates: FloatArray, overlap: int
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        """As of any cascade, the derivatives by real poles zero."""
        first = self.structure.n_static + int(self.structure.integrator)
        poles = slice(first, first + 2 * self.structure.real_poles, 2)
        for rows, begin, measured in super().linearise(coordinates, overlap):
            rows[poles] = 0.0
            yield rows, begin, measured
