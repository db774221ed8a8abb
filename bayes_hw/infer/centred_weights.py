"""Coordinates in which the weights of G's poles no longer follow the poles.

The response is linear in the weights. Given the poles p and the gain g of an integrator, least squares puts
the weights at w(p, g) = A(p)^-1 (Phi(p)^T r(g) + D m) with precision A(p) = Phi(p)^T Phi(p) + D: Phi are the
responses of the poles to the commands, r is what the estimate leaves to them, and D and m are precision and
mean of the prior. Both turn quickly where poles lie close together or a weight is hardly told from none, and
a posterior of weights and poles is then a bent ridge or a funnel. In the coordinates

    c = L(p)^T (weights - w(p, g)),    L L^T = A(p)

c is nearly standard normal whatever the poles are: the separation of variables of Golub and Pereyra
(doi 10.1088/0266-5611/19/2/201), with the weights kept. Where records begin in motion the states that they
begin in are weights too, of free responses of the poles. The map is one to one and its Jacobian is exact, so
that the density is as it was; what is approximate, responses to the commands inside the limits of the
estimate under its noise, the dead zone as nothing, decides only how straight it becomes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.infer.responses_in_frequency import ResponsesInFrequency
from bayes_hw.infer.responses_in_time import ResponsesInTime
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import ParameterVector
from bayes_hw.record import Record

POINTS_AT_ONCE = 32


@dataclass(frozen=True, eq=False)
class CentredWeights:
    """The map between these coordinates and those of the parameters, for points (..., parameters).

    `rows` are those of the weights, and of initial states where these are free; `responses` says what a unit
    of each answers.
    """

    axis: AxisParameters
    rows: tuple[int, ...]
    gain_row: int | None
    responses: ResponsesInFrequency | ResponsesInTime
    prior_mean: FloatArray
    prior_precision: FloatArray

    @classmethod
    def of(
        cls,
        axis: AxisParameters,
        values: FloatArray,
        noise: NoiseEstimate,
        records: Sequence[Record],
        power: float = 1.0,
        states: bool = True,
    ) -> CentredWeights | None:
        """For an axis, an estimate of its parameters (parameters,), more of them are not looked at, the noise
        there and the power of the likelihood, with initial `states` where these are free, which costs much
        more; None where no weight is free."""
        values = values[: len(axis.parameters)]
        if not axis.weight_rows:
            return None
        starts = axis.start_rows if states else ()
        rows = (*axis.weight_rows, *starts)
        priors = [found for row in rows if (found := axis.parameters[row].prior.of_value) is not None]
        gain_row = axis.names.index("velocity_gain") if "velocity_gain" in axis.names else None
        kind = ResponsesInTime if starts else ResponsesInFrequency
        return cls(
            axis,
            rows,
            gain_row,
            kind.of(axis, values, noise, records, power),
            np.array([mean for mean, _ in priors]),
            np.array([1 / sd**2 for _, sd in priors]),
        )

    def to_plain(self, centred: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the parameters, and the log-Jacobian of going there, without the last axis; NaN
        where there are none."""
        return self._moved(centred, plain=True)

    def from_plain(self, plain: FloatArray) -> FloatArray:
        """The inverse of `to_plain`."""
        return self._moved(plain, plain=False)[0]

    def _moved(self, points: FloatArray, *, plain: bool) -> tuple[FloatArray, FloatArray]:
        flat = points.reshape(-1, points.shape[-1])
        moved, log_jacobian = flat.copy(), np.empty(len(flat))
        rows = list(self.rows)
        for begin in range(0, len(flat), POINTS_AT_ONCE):
            part = slice(begin, begin + POINTS_AT_ONCE)
            structure = np.ascontiguousarray(flat[part, : len(self.axis.parameters)].T)
            with np.errstate(all="ignore"):
                values = ParameterVector(self.axis.parameters).values(structure)
                batch = self.axis.linear_batch(values)
            weights = np.ascontiguousarray(flat[part][:, rows])
            _move(
                *self.responses(batch, self._per_sample(values)),
                self.responses.rounding,
                self.prior_precision,
                self.prior_mean,
                plain,
                weights,
                log_jacobian[part],
            )
            moved[part, rows] = weights
        return moved.reshape(points.shape), log_jacobian.reshape(points.shape[:-1])

    def _per_sample(self, values: FloatArray) -> FloatArray:
        """Steps of the integrator a unit of command and sample (points,), zero where there is none."""
        if self.gain_row is None:
            return np.zeros(values.shape[1])
        return np.asarray(values[self.gain_row] / self.axis.model.sample_rate_hz)


@compiled(nogil=True)
def _move(  # type: ignore[no-untyped-def]
    every, all_wanted, rounding, precision, mean, plain, weights, log_jacobian
):
    """Weights (points, n) moved in place, and the log-Jacobian (points,) of going to plain ones."""
    n = weights.shape[1]
    for k in range(len(weights)):
        rows, wanted = every[k], all_wanted[k]
        lower, centre = np.dot(rows, rows.T), np.dot(rows, wanted)
        logarithm = 0.0
        for i in range(n):
            centre[i] += precision[i] * mean[i]
            lower[i, i] = (lower[i, i] + precision[i]) * (1 + rounding)
            for j in range(i + 1):
                rest = lower[i, j]
                for m in range(j):
                    rest -= lower[i, m] * lower[j, m]
                lower[i, j] = np.sqrt(rest) if i == j else rest / lower[j, j]
            for m in range(i):
                centre[i] -= lower[i, m] * centre[m]
            centre[i] /= lower[i, i]
            logarithm -= np.log(lower[i, i])
        log_jacobian[k] = logarithm
        if plain:
            centre += weights[k]
        for i in range(n - 1, -1, -1):
            for m in range(i + 1, n):
                centre[i] -= lower[m, i] * centre[m]
            centre[i] /= lower[i, i]
        if plain:
            weights[k] = centre
            continue
        for i in range(n):
            weights[k, i] = lower[i, i] * (weights[k, i] - centre[i])
            for m in range(i + 1, n):
                weights[k, i] += lower[m, i] * (weights[k, m] - centre[m])
