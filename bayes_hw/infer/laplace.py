"""The Laplace approximation of a log-density at its modes, in plain coordinates or in straight ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.mixture import StudentTMixture, several_laplace
from bayes_hw.infer.reparameterisation import Reparameterisation

VALLEY = 2.0
"""Two modes are two where the log-density between them falls this far below the lower one."""
PATH_POINTS = 17


class LogDensity(Protocol):
    """A vectorised log-density that counts what it could not evaluate."""

    non_finite: int

    @property
    def names(self) -> tuple[str, ...]: ...

    def __call__(self, coordinates: FloatArray) -> FloatArray: ...


class StraightDensity:
    """A log-density as a function of straight coordinates, Jacobian included."""

    def __init__(self, density: LogDensity, straightening: Reparameterisation) -> None:
        self.density = density
        self.straightening = straightening

    @property
    def names(self) -> tuple[str, ...]:
        return self.density.names

    @property
    def non_finite(self) -> int:
        return self.density.non_finite

    @non_finite.setter
    def non_finite(self, count: int) -> None:
        self.density.non_finite = count

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        plain, log_jacobian = self.straightening.to_plain(coordinates)
        log_density = self.density(plain)
        return np.where(np.isfinite(log_density), log_density + log_jacobian, -np.inf)


@dataclass(frozen=True, eq=False)
class Laplace:
    """Approximate modes (parameters,) with their covariances, the best first, and the density of every
    ensemble, all in the same coordinates."""

    modes: Sequence[tuple[FloatArray, FloatArray]]
    densities: Sequence[LogDensity]
    straight: bool = False

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

    def straightened(self, straightening: Reparameterisation) -> Laplace:
        """The same in straight coordinates."""
        return Laplace(
            [
                (straightening.from_plain(mode), straightening.covariance_from_plain(mode, covariance))
                for mode, covariance in self.modes
            ],
            [StraightDensity(density, straightening) for density in self.densities],
            True,
        )
