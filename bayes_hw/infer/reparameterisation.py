"""A reparameterisation in which the ridges of the posterior are straight.

Behind an integrator the data fix how far the axis drifts, gain x mean(min(max(u, lower), upper)), far better
than either limit: in the limits' own coordinates the posterior is a curved ridge, in

    s_upper = -mean(max(u - upper, 0))^(2/3)
    s_lower = gain mean(min(max(u, lower), upper)) = gain (mean(u) - mean(max(u - upper, 0)) + m(lower))

with m(lower) = mean(max(lower - u, 0)) it is nearly normal. Both maps are tabulated on an even grid of
limits, interpolated linearly and continued so beyond it, which makes them one to one; the Jacobian is that of
the interpolation, so that the density stays exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.model.parameters import Parameter
from bayes_hw.record import Record

KNOTS = 512
NAMES = ("saturation.lower", "saturation.upper")
GAINS = ("gain", "velocity_gain")


@dataclass(frozen=True, eq=False)
class Table:
    """An increasing function given by `values` (knots,) on the even grid first, first + step, ..."""

    first: float
    step: float
    values: FloatArray

    def __call__(self, x: FloatArray) -> FloatArray:
        """The interpolated function."""
        place = (x - self.first) / self.step
        segment = np.clip(np.floor(np.nan_to_num(place)), 0, len(self.values) - 2).astype(np.int64)
        slope = self.values[segment + 1] - self.values[segment]
        return self.values[segment] + (place - segment) * slope

    def inverse(self, value: FloatArray) -> tuple[FloatArray, FloatArray]:
        """x (walkers,) at which the function is `value`, and dx / dvalue there."""
        x, slope = np.empty_like(value), np.empty_like(value)
        _inverse(self.first, self.step, self.values, value, x, slope)
        return x, slope


@compiled(nogil=True)
def _inverse(first, step, values, wanted, x, slope):  # type: ignore[no-untyped-def]
    for k in range(len(wanted)):
        low, high = 0, len(values) - 1
        while high - low > 1:
            middle = (low + high) // 2
            if values[middle] <= wanted[k]:
                low = middle
            else:
                high = middle
        slope[k] = step / (values[low + 1] - values[low])
        x[k] = first + step * low + (wanted[k] - values[low]) * slope[k]


@dataclass(frozen=True, eq=False)
class Reparameterisation:
    """The map between straight coordinates and those of the parameters, for points (..., parameters).

    The rows are those of the limits and of the gain, all three logarithms of magnitudes; `gain_row` is None
    where no gain is free.
    """

    lower_row: int
    upper_row: int
    gain_row: int | None
    mean_command: float
    lower: Table
    upper: Table

    @classmethod
    def of(cls, parameters: Sequence[Parameter], records: Sequence[Record]) -> Reparameterisation | None:
        """For the given parameters and records; None where the commands do not go to both sides of zero."""
        names = [parameter.name for parameter in parameters]
        u = np.sort(np.concatenate([record.u for record in records]))
        if not (u[0] < 0 < u[-1]):
            return None
        gains = [names.index(name) for name in GAINS if name in names]
        upper_first, upper_step, above = _mean_beyond(u)
        lower_first, lower_step, below = _mean_beyond(-u[::-1])
        lower = Table(-(lower_first + lower_step * (KNOTS - 1)), lower_step, below[::-1].copy())
        upper = Table(upper_first, upper_step, -(above ** (2 / 3)))
        if not all(np.all(np.diff(table.values) > 0) for table in (lower, upper)):
            return None
        gain_row = gains[0] if gains else None
        rows = names.index(NAMES[0]), names.index(NAMES[1]), gain_row
        return cls(*rows, float(u.mean()), lower, upper)

    def to_plain(self, straight: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Coordinates of the parameters, and the log-Jacobian of going there, without the last axis.

        NaN where a limit would have the wrong sign.
        """
        plain = straight.copy()
        shape = straight.shape[:-1]
        s_upper = straight[..., self.upper_row].ravel()
        upper, upper_slope = self.upper.inverse(s_upper)
        gain = self._gain(straight).ravel()
        drift = straight[..., self.lower_row].ravel() / gain
        lower, lower_slope = self.lower.inverse(drift - self.mean_command + _mean_above(s_upper))
        with np.errstate(invalid="ignore", divide="ignore"):
            log_upper, log_lower = np.log(upper), np.log(-lower)
            log_jacobian = np.log(upper_slope * lower_slope / gain) - log_upper - log_lower
        plain[..., self.upper_row] = log_upper.reshape(shape)
        plain[..., self.lower_row] = log_lower.reshape(shape)
        return plain, log_jacobian.reshape(shape)

    def from_plain(self, plain: FloatArray) -> FloatArray:
        """The inverse of `to_plain`."""
        straight = plain.copy()
        s_upper = self.upper(np.exp(plain[..., self.upper_row]))
        below = self.lower(-np.exp(plain[..., self.lower_row]))
        straight[..., self.upper_row] = s_upper
        straight[..., self.lower_row] = self._gain(plain) * (self.mean_command - _mean_above(s_upper) + below)
        return straight

    def _gain(self, points: FloatArray) -> FloatArray:
        if self.gain_row is None:
            return np.ones(points.shape[:-1])
        return np.exp(points[..., self.gain_row])


def _mean_above(s_upper: FloatArray) -> FloatArray:
    return np.maximum(-s_upper, 0.0) ** 1.5


def _mean_beyond(u: FloatArray) -> tuple[float, float, FloatArray]:
    """mean(max(u - limit, 0)) at KNOTS limits from 0 to max(u), for sorted u: first, step, values."""
    limits = np.linspace(0.0, u[-1], KNOTS)
    sums = np.concatenate([np.cumsum(u[::-1])[::-1], [0.0]])
    places = np.searchsorted(u, limits, side="right")
    values = (sums[places] - limits * (len(u) - places)) / len(u)
    return 0.0, float(limits[1]), np.maximum(values, 0.0)
