"""A torque's port held to the way of what the loop reads.

What a velocity loop misreads enters where its command does: an error of the measured speed moves w as the
command would, G, but for the terms of the controller that only one of both has (feed-forward, derivative
action). An error of the speed that is periodic in position is the rate of a function of position, so that it
enters as s G(s) (c0 + c1 s + ...): a port of few numbers (`JointResponse.held_numbers`) where a torque of its
own has one for every pole.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayes_hw.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import Point, descend, evaluate, prior_precision, triangular_factor

PHASE = 1
"""Which of a ripple's parameters its phase is."""

SLOPE_STEP = 1e-5
"""Of a coordinate, for the slopes of G's way."""

HELD_SHARE = 1e-9
"""Of the largest weight of a port, that rounding may leave beside the way."""

TURNS, HELD_STEPS = np.linspace(0.0, np.pi, 4, endpoint=False), 20
"""Of a ripple's phase, from which descents begin, and their steps: a way that is wrong is another phase's."""


def numbers_saved(response: JointResponse) -> int:
    """How many numbers fewer than a free one a port has that is held."""
    return response.structure.real_poles + 2 * response.structure.sections + 2 - response.held_numbers


def held_point(response: JointResponse, point: Point, number: int) -> Point | None:
    """The best end of descents with the port of effect `number` held and all else free, which begin at
    `point` and at other phases of the ripple; None where derivatives there are not finite."""
    held = HeldResponse(response, number)
    try:
        ends = [descend(held, held.begun(point, turn), HELD_STEPS) for turn in TURNS]
    except FloatingPointError:
        return None
    best = max(ends, key=lambda end: end.log_likelihood)
    return replace(best, coordinates=held.whole(best.coordinates), converged=False)


def nats_lost(response: JointResponse, point: Point, number: int) -> float:
    """By which the explanation at `point` is likelier than with the port of effect `number` held; none where
    it is."""
    if HeldResponse(response, number).is_held(point):
        return 0.0
    held = held_point(response, point, number)
    return np.inf if held is None else max(point.log_likelihood - held.log_likelihood, 0.0)


@dataclass(frozen=True, eq=False)
class HeldResponse:
    """A joint response with the port of effect `number` held: coordinates are those of the rest, then the
    numbers c0, c1, ..."""

    response: JointResponse
    number: int

    @cached_property
    def _port(self) -> IntArray:
        """Coordinates of the port's weights, the direct path's last."""
        response = self.response
        at = response.first_coordinate(self.number) + len(response.template[self.number].values)
        return np.arange(at, at + response.structure.real_poles + 2 * response.structure.sections + 1)

    @cached_property
    def _rest(self) -> IntArray:
        """All others but the direct path's pole, which moves nothing."""
        return np.delete(np.arange(self.response.size), [*self._port, self._port[-1] + 1])

    @property
    def masks(self) -> Sequence[BoolArray] | None:
        return self.response.masks

    @property
    def level_shapes(self) -> Sequence[FloatArray]:
        return self.response.level_shapes

    def is_held(self, point: Point) -> bool:
        """Whether the port at a point already goes the way that it is held to."""
        ways, own = self._ways(point.coordinates), point.coordinates[self._port]
        left = own - ways @ np.linalg.lstsq(ways, own, rcond=None)[0]
        return bool(np.abs(left).max() <= HELD_SHARE * np.abs(own).max())

    def begun(self, point: Point, turn: float) -> Point:
        """At the rest of `point` with the ripple's phase further by `turn`, and the numbers that least
        squares asks for there. Raises FloatingPointError where derivatives are not finite."""
        count, coordinates = self.response.held_numbers, point.coordinates.copy()
        coordinates[self.response.first_coordinate(self.number) + PHASE] += turn
        coordinates = np.concatenate([coordinates[self._rest], np.zeros(count)])
        factor = triangular_factor(self, evaluate(self, coordinates, point.whitener))
        numbers, target = factor[:-1, -count - 1 : -1], factor[:-1, -1]
        coordinates[-count:] = np.linalg.lstsq(numbers, target, rcond=None)[0]
        return evaluate(self, coordinates, point.whitener)

    def whole(self, coordinates: FloatArray) -> FloatArray:
        """Those of the joint response (size,)."""
        found = np.zeros(self.response.size)
        count = self.response.held_numbers
        found[self._rest] = coordinates[:-count]
        found[self._port] = self._ways(found) @ coordinates[-count:]
        return found

    def _ways(self, whole: FloatArray) -> FloatArray:
        return held_ways(self.response.values(whole), self.response.held_numbers)

    def residuals(self, coordinates: FloatArray) -> list[FloatArray]:
        """As the joint response has them."""
        return self.response.residuals(self.whole(coordinates))

    def noise_of(self, residuals: Sequence[FloatArray], most: int, previous: Whitener | None) -> Whitener:
        """As the joint response has it."""
        return self.response.noise_of(residuals, most, previous)

    def prior_precision(self) -> FloatArray:
        """That of the rest; of the port's numbers nothing is known."""
        own = prior_precision(self.response, np.zeros(self.response.size))[self._rest]
        return np.concatenate([own, np.zeros(self.response.held_numbers)])

    def admissible(self, coordinates: FloatArray, previous: FloatArray) -> FloatArray:
        """As the joint response has it; any numbers of the port."""
        found = self.response.admissible(self.whole(coordinates), self.whole(previous))[self._rest]
        return np.concatenate([found, coordinates[-self.response.held_numbers :]])

    def linearise(
        self, coordinates: FloatArray, overlap: int
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        """As the joint response does, by the coordinates here."""
        whole = self.whole(coordinates)
        ways, slopes = self._ways(whole), self._slopes(whole, coordinates[-self.response.held_numbers :])
        for rows, first, measured in self.response.linearise(whole, overlap):
            own = rows[self._port]
            found = rows[self._rest] + slopes[:, self._rest].T @ own
            yield np.concatenate([found, ways.T @ own, rows[-1:]]), first, measured

    def _slopes(self, whole: FloatArray, strengths: FloatArray) -> FloatArray:
        """Of the port's weights (weights, size) by the coordinates of G, central differences."""
        slopes = np.zeros((len(self._port), self.response.size))
        for i in range(self.response.first_coordinate(0)):
            step = np.zeros(self.response.size)
            step[i] = SLOPE_STEP * max(1.0, abs(whole[i]))
            slopes[:, i] = (self._ways(whole + step) - self._ways(whole - step)) @ strengths / (2 * step[i])
        return slopes


def held_ways(values: JointValues, count: int) -> FloatArray:
    """Weights (weights, count) of a port, real poles, sections and the direct path in turn, by which a torque
    enters as s G(s), s^2 G(s) and so on, s in 1/sample."""
    cascade = values.cascade
    n, m = cascade.real.shape[1], cascade.sections.shape[1]
    found = np.zeros((n + 2 * m + 1, count))
    real, pairs = cascade.real[1], cascade.sections[2:].copy()
    for power in range(count):
        real = real * _rates(cascade.real[0].astype(np.complex128)).real
        for i, (a1, a2) in enumerate(cascade.sections[:2].T):
            pairs[:, i] = _rate_of_pair(a1, a2) @ pairs[:, i]
        found[:n, power], found[n:-1, power] = real, pairs.ravel()
    return found


def _rates(poles: ComplexArray) -> ComplexArray:
    """Continuous poles, 1/sample, of discrete ones; those of no continuous pole by the difference."""
    continuous = (poles.real > 0) | (poles.imag != 0)
    return np.where(continuous, np.log(np.where(continuous, poles, 1.0)), poles - 1)


def _rate_of_pair(a1: float, a2: float) -> FloatArray:
    """The continuous matrix (2, 2) of a section, whose discrete one is [[a1, 1], [-a2, 0]]."""
    one, two = np.roots([1.0, -a1, a2]).astype(np.complex128)
    rate, other = _rates(np.array([one, two]))
    slope = (rate - other) / (one - two) if one != two else 1 / one
    return np.asarray((rate - slope * one) * np.eye(2) + slope * np.array([[a1, 1.0], [-a2, 0.0]])).real
