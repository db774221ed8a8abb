"""The log-posterior density of a Hammerstein-Wiener axis given its records.

The level from which the angles of a record count is integrated out of its likelihood.

A record that does not begin at zero counts from the mean of its first samples at rest, which is known no
better than they say: y = simulated y + level + noise. The likelihood of normal noise is quadratic in the
level, so that three of its values tell all of it, and its integral over a flat prior is exact. Every sample
is used once: those at rest are among the ones that the likelihood holds.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.holes import Holes
from bayes_hw.identify.noise import autoregression_from_partial
from bayes_hw.identify.output_error import known_signals, simulated_outputs
from bayes_hw.infer.noise import (
    is_student_t,
    log_likelihood,
    noise_order,
    robust_log_likelihood,
    robust_precision,
)
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.kernel import NONE, LaggedSums, lagged_residual_sums
from bayes_hw.model.parameters import Parameter, ParameterVector, as_coordinates, as_values
from bayes_hw.model.robust_kernel import robust_residual_sums
from bayes_hw.record import Record

FAR = 30.0
"""Steps from the level of the highest likelihood: farther off, its second difference has lost digits."""


def shifted(sums: LaggedSums, samples: int, level: FloatArray) -> LaggedSums:
    """The sums of residuals less `level` (walkers,), of one record of so many samples."""
    lagged = np.empty_like(sums.lagged)
    first, last = np.zeros_like(level), np.zeros_like(level)
    for lag in range(len(lagged)):
        if lag:
            first = first + sums.head[lag - 1]
            last = last + sums.tail[len(sums.tail) - lag]
        both = 2 * sums.whole[0] - first - last
        lagged[lag] = sums.lagged[lag] - level * both + (samples - lag) * level**2
    return LaggedSums(
        lagged, sums.head - level, sums.tail - level, sums.near - level, sums.whole - samples * level
    )


def integrated(
    likelihood: Callable[[LaggedSums], FloatArray], sums: LaggedSums, samples: int, step: FloatArray
) -> FloatArray:
    """Logarithm of the integral of a record's likelihood over its level (walkers,), with a flat prior.

    `likelihood` is the logarithm of it under sums, `step` (walkers,) the level at which it is tried, of the
    size of the noise.
    """
    top, height, curvature = _parabola(likelihood, sums, samples, step)
    if np.any(np.abs(top) > FAR):
        near = shifted(sums, samples, top * step)
        top, height, curvature = _parabola(likelihood, near, samples, step)
    return height + 0.5 * top**2 * curvature + 0.5 * np.log(2 * np.pi * step**2 / curvature)


def _parabola(
    likelihood: Callable[[LaggedSums], FloatArray], sums: LaggedSums, samples: int, step: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Where over the level the likelihood is highest, in steps from that of the sums; its value at the sums,
    and its curvature. All (walkers,)."""
    at_zero = likelihood(sums)
    above, below = (likelihood(shifted(sums, samples, sign * step)) for sign in (1.0, -1.0))
    curvature = np.maximum(2 * at_zero - above - below, np.finfo(float).tiny)
    return 0.5 * (above - below) / curvature, at_zero, curvature


class LogPosterior:
    """log p(coordinates | records), up to the evidence, for many walkers in one call.

    Generative model: y = n(G f(u)) + e with e a stationary AR(p) process of normal or Student-t innovations,
    independent between records (see `bayes_hw.infer.noise`), and independent priors on the parameters'
    values. Samples that were not measured are not part of it. Under normal innovations the level of a record
    that does not count from zero is integrated out. The density is that of the
    unbounded coordinates, Jacobian included.

    `parameters` are those of the axis followed by the noise's: `noise` holds sigma, p partial
    autocorrelations and, for Student-t innovations, their degrees of freedom. `non_finite` counts the
    evaluations that gave no finite number inside the prior's support; they count as impossible. The
    likelihood enters to the given `power`.
    """

    def __init__(
        self,
        axis: AxisParameters,
        noise: tuple[Parameter, ...],
        records: Sequence[Record],
        power: float = 1.0,
    ) -> None:
        self.power = power
        self.axis = axis
        self.noise = noise
        self.records = tuple(records)
        self.parameters: tuple[Parameter, ...] = (*axis.parameters, *noise)
        self.order = noise_order(noise)
        self.student_t = is_student_t(noise)
        self.non_finite = 0
        self._vector = ParameterVector(self.parameters)
        self._known = known_signals(axis, records)
        self._holes = [
            None if record.measured is None else Holes.of(record.measured, self.order) for record in records
        ]
        self._outputs = self._summed()

    @property
    def dimension(self) -> int:
        return len(self.parameters)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(parameter.name for parameter in self.parameters)

    def coordinates(self, values: FloatArray) -> FloatArray:
        """Values (..., parameters) as coordinates of the same shape."""
        return np.moveaxis(as_coordinates(self.parameters, np.moveaxis(values, -1, 0)), 0, -1)

    def values(self, coordinates: FloatArray) -> FloatArray:
        """Coordinates (..., parameters) as values of the same shape."""
        return np.moveaxis(as_values(self.parameters, np.moveaxis(coordinates, -1, 0)), 0, -1)

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        """Log-posterior density (walkers,) of coordinates (walkers, parameters)."""
        columns = np.ascontiguousarray(coordinates.T)
        with np.errstate(all="ignore"):
            values = self._vector.values(columns)
            result = self._vector.log_prior(columns, values)
            possible = np.isfinite(result) & np.all(np.isfinite(values), axis=0)
            possible &= self.axis.in_order(values)
            if np.all(possible):
                result += self.log_likelihood(values)
            else:
                result[~possible] = -np.inf
                if np.any(possible):
                    result[possible] += self.log_likelihood(values[:, possible])
        broken = ~np.isfinite(result) & possible
        self.non_finite += int(np.count_nonzero(broken))
        result[broken] = -np.inf
        return result

    def log_likelihood(self, values: FloatArray) -> FloatArray:
        """Log-likelihood (walkers,) of values (parameters, walkers) of all records, times the power."""
        n_axis = len(self.axis.parameters)
        sigma, partial = values[n_axis], values[n_axis + 1 : n_axis + 1 + self.order]
        delay = self.axis.model.linear.delay_samples
        total = np.zeros(values.shape[1])
        for number, (record, outputs) in enumerate(zip(self.records, self._outputs, strict=True)):
            if number == 0 or self.axis.start_positions is not None:
                form = self.axis.modal_form(values[:n_axis], number)
            before = 0.0 if self.axis.start_positions is None else float(record.u[0])
            holes = self._holes[number]
            near = NONE if holes is None else holes.near
            signals = self._known[number]
            if self.student_t:
                degrees = values[-1]
                noise = autoregression_from_partial(partial), robust_precision(sigma, partial, degrees)
                robust = robust_residual_sums(form, record.u, outputs, delay, *noise, before, near, signals)
                total += robust_log_likelihood(robust, len(record), sigma, partial, degrees, holes)
                continue
            sums = lagged_residual_sums(form, record.u, outputs, delay, self.order, before, near, signals)
            total += self.of_sums(sums, number, sigma, partial)
        return self.power * total

    def _integrates(self, record: Record) -> bool:
        """Whether the level of a record is integrated out."""
        return record.has_free_level and self.axis.start_positions is None

    def _summed(self) -> list[FloatArray]:
        """The angles (samples,) of every record as they are summed, near those of the nominal axis.

        They count from their level there where it is integrated out, or nothing was measured where the record
        begins, and are the axis's own where nothing was measured: what the likelihood does not depend on
        would else cost it digits.
        """
        if all(record.measured is None and not self._integrates(record) for record in self.records):
            return [record.y for record in self.records]
        with np.errstate(all="ignore"):
            found = simulated_outputs(self.axis, self.axis.nominal[:, None], self.records, self._known)
        return [self._near(record, nominal[0]) for record, nominal in zip(self.records, found, strict=True)]

    def _near(self, record: Record, nominal: FloatArray) -> FloatArray:
        left, measured = record.y - nominal, record.measured_samples
        if not np.isfinite(left).all():
            return record.y
        is_free = self._integrates(record) and not (self.student_t and measured[0])
        level = float(np.median(left[measured])) if is_free else 0.0
        return np.where(measured, record.y - level, nominal)

    def of_sums(self, sums: LaggedSums, number: int, sigma: FloatArray, partial: FloatArray) -> FloatArray:
        """Log-likelihood (walkers,) of one record under normal innovations."""
        record, holes = self.records[number], self._holes[number]
        samples = len(record)
        if not self._integrates(record):
            return log_likelihood(sums, samples, sigma, partial, holes)
        return integrated(
            lambda shifted: log_likelihood(shifted, samples, sigma, partial, holes), sums, samples, sigma
        )
