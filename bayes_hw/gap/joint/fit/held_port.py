"""A torque's port held to the way of what the loop reads.

What a velocity loop misreads enters where its command does: an error of the measured speed moves w as the
command would, G, but for the terms of the controller that only one of both has (feed-forward, derivative
action). An error of the speed that is periodic in position is the rate of a function of position, so that it
enters as s G(s) (c0 + c1 s + ...): a port of few numbers (`JointResponse.held_numbers`) where a torque of its
own has one for every pole.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import Point, triangular_factor

SLOPE_STEP, STRENGTH_ROUNDS = 1e-5, 3
"""Of a coordinate, for slopes of G's way; rounds in which the strengths and these slopes settle."""


def numbers_saved(response: JointResponse) -> int:
    """How many numbers fewer than a free one a port has that is held."""
    return response.structure.real_poles + 2 * response.structure.sections + 2 - response.held_numbers


def nats_lost(response: JointResponse, point: Point, number: int) -> float:
    """Nats by which the explanation at `point`, whose effect `number` has a free port, is likelier than the
    best one with that port held, all else free: to second order about the point (Wald). Infinite where
    derivatives are."""
    at = response.first_coordinate(number) + len(response.template[number].values)
    count = response.structure.real_poles + 2 * response.structure.sections + 1
    port = np.arange(at, at + count)
    try:
        factor = triangular_factor(response, point)
    except FloatingPointError:
        return np.inf
    variance = point.variance_by(factor)
    ways, slopes = _ways_and_slopes(response, point.coordinates)
    own = factor[:-1, port]
    # The pole of the direct path moves nothing where that path is held at none.
    rest = np.delete(np.arange(response.size), [*port, at + count])
    strengths = np.linalg.lstsq(own @ ways, own @ point.coordinates[port], rcond=None)[0]
    left = np.inf
    for _ in range(STRENGTH_ROUNDS):
        moves = factor[:-1, rest] + own @ (slopes @ strengths)[:, rest]
        columns, wanted = np.column_stack([moves, own @ ways]), own @ point.coordinates[port]
        found = np.linalg.lstsq(columns, wanted, rcond=None)[0]
        strengths, left = found[-response.held_numbers:], float(np.sum((columns @ found - wanted) ** 2))
    return 0.5 * left / variance


def _ways_and_slopes(response: JointResponse, coordinates: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The ways of c0, c1, ... through a port (weights, numbers), its direct path last, and their slopes
    (weights, size, numbers) by the coordinates of G."""
    count = response.held_numbers
    ways = held_ways(response.values(coordinates), count)
    slopes = np.zeros((len(ways), response.size, count))
    for i in range(response.first_coordinate(0)):
        step = np.zeros(response.size)
        step[i] = SLOPE_STEP * max(1.0, abs(coordinates[i]))
        above, below = (held_ways(response.values(coordinates + sign * step), count) for sign in (1, -1))
        slopes[:, i] = (above - below) / (2 * step[i])
    return ways, slopes


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
