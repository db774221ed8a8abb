"""Levenberg-Marquardt descent of a response on coloured noise, the noise estimated again on the way."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.growth.coloured import Whitener

FIRST_DAMPING, LEAST_DAMPING, LARGEST_DAMPING = 1e-3, 1e-9, 1e7
STEPS_BETWEEN_NOISE = 3
"""Accepted steps after which the noise is estimated again."""

SMALL_GAIN_NATS = 1.0
"""A step that gains less has the noise estimated again at once."""

CONVERGED_NATS = 0.02
"""A descent ends when a step with fresh noise gains less log-likelihood than this."""


class Response(Protocol):
    """What a descent needs: residuals, their derivatives, and which coordinates mean something."""

    def residuals(self, coordinates: FloatArray) -> list[FloatArray]: ...

    def linearise(self, coordinates: FloatArray, overlap: int) -> Iterator[tuple[FloatArray, int]]: ...

    def admissible(self, coordinates: FloatArray, previous: FloatArray) -> FloatArray: ...


@dataclass(frozen=True, eq=False)
class Point:
    """Where a descent stands: coordinates (size,), residuals of every record, noise, log-likelihood."""

    coordinates: FloatArray
    residuals: tuple[FloatArray, ...]
    whitener: Whitener
    log_likelihood: float
    converged: bool = False

    @property
    def samples(self) -> int:
        return sum(len(e) for e in self.residuals)

    @property
    def rms(self) -> float:
        """Root mean square residual, output units."""
        return float(np.sqrt(sum(float(e @ e) for e in self.residuals) / self.samples))


def evaluate(response: Response, coordinates: FloatArray, whitener: Whitener | None = None) -> Point:
    """The point at `coordinates`, its noise estimated there unless given."""
    residuals = tuple(response.residuals(coordinates))
    whitener = whitener or Whitener.of_residuals(residuals)
    return Point(coordinates, residuals, whitener, whitener.log_likelihood(residuals))


def triangular_factor(response: Response, point: Point) -> FloatArray:
    """R (size + 1, size + 1) of the whitened derivatives and residual, without holding all of them."""
    factor: FloatArray | None = None
    for rows, first in response.linearise(point.coordinates, point.whitener.order):
        block = point.whitener.apply(rows, first)
        stacked = block.T if factor is None else np.concatenate([factor, block.T])
        if not np.isfinite(stacked).all():
            raise FloatingPointError("derivatives are not finite")
        factor = linalg.qr(stacked, mode="r", overwrite_a=True, check_finite=False)[0][: len(rows)]
    assert factor is not None
    return factor


def descend(response: Response, start: Point, steps: int, order: int | None = None) -> Point:
    """At most `steps` accepted steps from `start`; the noise is that of the residuals at the end.

    On the way the noise is of `order` where that is given: under white noise (order 0) what is slow is not
    explained by the noise. Marquardt's scaling by column norms; the damping falls by 10 on success and grows
    by 4 on failure.
    """
    point, damping, accepted = start, FIRST_DAMPING, 0
    if order is not None:
        point = _with_fresh_noise(point, order)
    reference = point.log_likelihood
    while accepted < steps:
        moved = _step(response, point, damping)
        if moved is None:
            break
        gained = moved[0].log_likelihood - point.log_likelihood
        point, damping = moved
        accepted += 1
        if accepted % STEPS_BETWEEN_NOISE == 0 or gained < SMALL_GAIN_NATS:
            point = _with_fresh_noise(point, order)
            if point.log_likelihood - reference < CONVERGED_NATS:
                return _ended(_with_fresh_noise(point), order is None)
            reference = point.log_likelihood
    return _ended(_with_fresh_noise(point), accepted < steps and order is None)


def _ended(point: Point, converged: bool) -> Point:
    return Point(point.coordinates, point.residuals, point.whitener, point.log_likelihood, converged)


def _with_fresh_noise(point: Point, order: int | None = None) -> Point:
    whitener = Whitener.of_residuals(point.residuals, order)
    return Point(point.coordinates, point.residuals, whitener, whitener.log_likelihood(point.residuals))


def _step(response: Response, point: Point, damping: float) -> tuple[Point, float] | None:
    """The next point and its damping, or None where no step gains."""
    try:
        factor = triangular_factor(response, point)
    except FloatingPointError:
        return None
    size = len(point.coordinates)
    matrix, target = factor[:size, :size], factor[:size, size]
    norms = np.sqrt(np.sum(matrix**2, axis=0))
    norms[norms == 0] = 1.0
    scaled = matrix / norms
    while damping < LARGEST_DAMPING:
        system = np.concatenate([scaled, np.sqrt(damping) * np.eye(size)])
        right = np.concatenate([target, np.zeros(size)])
        solution = np.linalg.lstsq(system, right, rcond=None)[0] / norms
        coordinates = response.admissible(point.coordinates + solution, point.coordinates)
        with np.errstate(all="ignore"):
            residuals = tuple(response.residuals(coordinates))
            gained = all(np.isfinite(e).all() for e in residuals)
            if gained:
                reached = point.whitener.log_likelihood(residuals)
                gained = reached > point.log_likelihood
        if gained:
            moved = Point(coordinates, residuals, point.whitener, reached)
            return moved, max(damping / 10, LEAST_DAMPING)
        damping *= 4
    return None
