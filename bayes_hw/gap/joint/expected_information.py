"""What a command is expected to tell about the effects of a corrected axis (Laplace approximation)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.corrected_axis import CorrectedAxis
from bayes_hw.record import Record, Units

OUTPUT_DRAWS = 24
RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class ExpectedInformation:
    """Of a corrected axis; `units` are its records'."""

    axis: CorrectedAxis
    units: Units

    @cached_property
    def _scaled(self) -> tuple[FloatArray, FloatArray]:
        """Standard deviations of the coordinates and the inverse of their correlation, ridged."""
        deviation = self.axis.coordinates.std(axis=0)
        deviation[deviation == 0] = 1.0
        scaled = (self.axis.coordinates - self.axis.centre) / deviation
        correlation = scaled.T @ scaled / len(scaled)
        return deviation, np.linalg.inv(correlation + RIDGE * np.eye(len(correlation)))

    @property
    def _rows(self) -> list[int]:
        """Coordinates of the effects, all where there are none."""
        response = self.axis.response
        first = response.size - sum(response.effect_sizes)
        return list(range(first if first < response.size else 0, response.size))

    def outputs(self, u: FloatArray) -> FloatArray:
        """Angles (draws, samples) that draws of the axis answer with."""
        response = self.axis.response
        drawn = self.axis.coordinates[:OUTPUT_DRAWS]
        return np.array([response.simulate(response.values(x), u, self._at_rest(u)).y for x in drawn])

    def _at_rest(self, u: FloatArray) -> dict[str, FloatArray]:
        """Known inputs that do not change."""
        return {e.form.column: np.zeros(len(u)) for e in self.axis.response.template if e.form.is_known_input}

    def nats(self, u: FloatArray) -> float:
        """Half the fall of the log-determinant of the covariance of the effects' parameters, noise white."""
        after, before = self._covariances(u)
        return 0.5 * float(np.linalg.slogdet(before)[1] - np.linalg.slogdet(after)[1])

    def narrowing(self, u: FloatArray) -> float:
        """Geometric mean of the effects' standard deviations after over before."""
        after, before = self._covariances(u)
        return float(np.exp(0.5 * np.mean(np.log(np.diag(after) / np.diag(before)))))

    def _covariances(self, u: FloatArray) -> tuple[FloatArray, FloatArray]:
        response, rate = self.axis.response, self.axis.response.scale.rate_hz
        record = Record(
            "trial", np.arange(len(u)) / rate, u, np.zeros(len(u)), rate, self.units, known=self._at_rest(u)
        )
        trial = replace(response, records=[record], weights=None)
        ((tangents, *_),) = trial.linearise(self.axis.centre, 0)
        deviation, precision = self._scaled
        sigma = float(self.axis.posterior.point_estimate[-1])
        rows = np.nan_to_num(tangents[:-1] * deviation[:, None] / sigma)
        after = np.linalg.inv(precision + rows @ rows.T)
        before = np.linalg.inv(precision)
        chosen = np.ix_(self._rows, self._rows)
        small = RIDGE * np.eye(len(self._rows))
        return after[chosen] + small, before[chosen] + small
