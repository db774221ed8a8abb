"""What a command is expected to tell about the effects of an axis (Laplace approximation, white noise)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray

OUTPUT_DRAWS = 24
RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class ExpectedInformation:
    """`draws` (draws, size) of coordinates about `location` (size,), those from `first` on of the effects,
    all where there are none; `sigma` of the noise. `angles` gives what so many draws answer a command with,
    (draws, samples), `tangents` (size, samples) the derivatives at the estimate."""

    draws: FloatArray
    location: FloatArray
    first: int
    sigma: float
    angles: Callable[[FloatArray, int], FloatArray]
    tangents: Callable[[FloatArray], FloatArray]

    def outputs(self, u: FloatArray) -> FloatArray:
        """Angles (draws, samples) that draws of the axis answer with."""
        return self.angles(u, OUTPUT_DRAWS)

    def nats(self, u: FloatArray) -> float:
        """Half the fall of the log-determinant of the covariance of the effects' parameters."""
        after, before = self._covariances(u)
        return 0.5 * float(np.linalg.slogdet(before)[1] - np.linalg.slogdet(after)[1])

    def narrowing(self, u: FloatArray) -> float:
        """Geometric mean of the effects' standard deviations after over before."""
        after, before = self._covariances(u)
        return float(np.exp(0.5 * np.mean(np.log(np.diag(after) / np.diag(before)))))

    @cached_property
    def _known(self) -> tuple[FloatArray, FloatArray]:
        """Standard deviations of the coordinates and the inverse of their correlation, ridged."""
        deviation = self.draws.std(axis=0)
        deviation[deviation == 0] = 1.0
        scaled = (self.draws - self.location) / deviation
        correlation = scaled.T @ scaled / len(scaled)
        return deviation, np.linalg.inv(correlation + RIDGE * np.eye(len(correlation)))

    def _covariances(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        deviation, precision = self._known
        rows = np.nan_to_num(self.tangents(u) * deviation[:, None] / self.sigma)
        after, before = np.linalg.inv(precision + rows @ rows.T), np.linalg.inv(precision)
        first = self.first if self.first < len(deviation) else 0
        small = RIDGE * np.eye(len(deviation) - first)
        return after[first:, first:] + small, before[first:, first:] + small
