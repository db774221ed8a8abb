"""The Laplace approximation of a log-density at its modes, in the parameters' coordinates or in others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.mixture import StudentTMixture, several_laplace

VALLEY = 2.0
"""Two modes are two where the log-density between them falls this far below the lower one."""
PATH_POINTS = 17
JACOBIAN_STEP = 1e-4
"""Of a standard deviation."""


class LogDensity(Protocol):
    """A vectorised log-density that counts what it could not evaluate."""

    non_finite: int

    @property
    def names(self) -> tuple[str, ...]: ...

    def __call__(self, coordinates: FloatArray) -> FloatArray: ...


class CoordinateMap(Protocol):
    """A one-to-one map between some coordinates and those of the parameters, for points (..., parameters)."""

    def to_plain(self, points: FloatArray, /) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the parameters, and the log-Jacobian of going there, without the last axis; NaN
        where there are none."""
        ...

    def from_plain(self, plain: FloatArray) -> FloatArray:
        """The inverse of `to_plain`."""
        ...


class Through:
    """What a log-density as a function of other coordinates has of that density: its names, and how often it
    was not finite."""

    def __init__(self, density: LogDensity) -> None:
        self.density = density

    @property
    def names(self) -> tuple[str, ...]:
        return self.density.names

    @property
    def non_finite(self) -> int:
        return self.density.non_finite

    @non_finite.setter
    def non_finite(self, count: int) -> None:
        self.density.non_finite = count


class StraightDensity(Through):
    """A log-density as a function of other coordinates, Jacobian included."""

    def __init__(self, density: LogDensity, mapping: CoordinateMap) -> None:
        super().__init__(density)
        self.mapping = mapping

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        plain, log_jacobian = self.mapping.to_plain(coordinates)
        log_density = self.density(plain)
        return np.where(np.isfinite(log_density), log_density + log_jacobian, -np.inf)


@dataclass(frozen=True, eq=False)
class Laplace:
    """Approximate modes (parameters,) with their covariances, the best first, and the density of every
    ensemble, all in the same coordinates: those that `maps` lead to, one after the other, from the
    parameters' own; `choice` is their number among those that a sampler may take."""

    modes: Sequence[tuple[FloatArray, FloatArray]]
    densities: Sequence[LogDensity]
    choice: int = 0
    maps: tuple[CoordinateMap, ...] = ()

    @property
    def dimension(self) -> int:
        return len(self.modes[0][0])

    def proposal(self, inflation: float = 1.0) -> StudentTMixture:
        """A t component at every mode, its scale matrix `inflation` times the covariance."""
        return several_laplace(self.modes, inflation)

    def separated(self) -> Laplace:
        """Without the modes that no valley parts from a better one: two places on one ridge."""
        density, kept = self.densities[0], [self.modes[0]]
        shares = np.linspace(0.0, 1.0, PATH_POINTS)[:, None]
        for mode, covariance in self.modes[1:]:
            heights = [density(one + shares * (mode - one)) for one, _ in kept]
            if all(np.min(h) < min(h[0], h[-1]) - VALLEY for h in heights):
                kept.append((mode, covariance))
        return replace(self, modes=kept)

    def carried(self, mapping: CoordinateMap) -> Laplace:
        """The same in the coordinates of a map."""
        return replace(
            self,
            modes=[
                (mapping.from_plain(mode), carried_covariance(mapping, mode, covariance))
                for mode, covariance in self.modes
            ],
            densities=[StraightDensity(density, mapping) for density in self.densities],
            maps=(*self.maps, mapping),
        )

    def to_plain(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the parameters, and the log-Jacobian of going there, without the last axis."""
        log_jacobian = np.zeros(points.shape[:-1])
        for mapping in reversed(self.maps):
            points, part = mapping.to_plain(points)
            log_jacobian += part
        return points, log_jacobian


def carried_covariance(mapping: CoordinateMap, mode: FloatArray, covariance: FloatArray) -> FloatArray:
    """A covariance at `mode` (parameters,) carried over by the Jacobian of `from_plain`."""
    step = JACOBIAN_STEP * np.diag(np.sqrt(np.diag(covariance)))
    difference = mapping.from_plain(mode + step) - mapping.from_plain(mode - step)
    jacobian = difference.T / (2 * np.diag(step))
    carried = jacobian @ covariance @ jacobian.T
    return np.asarray(0.5 * (carried + carried.T))
