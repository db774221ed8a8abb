"""Responses of poles to the commands of records at rest, over groups of frequencies.

An equation is a frequency: the real parts of all come first, then the imaginary ones. Commands count with the
power that they have inside the limits of the estimate, over that of its noise; how responses of one record
begin and end is not looked at.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.modal import LinearBatch, ResidueBatch
from bayes_hw.record import Record

GROUPS, GROUPS_OF_A_PAIR = 40, 8
"""Of frequencies: over the whole band evenly in their logarithms, and more about the resonance of a pair."""
NARROWEST = 1e-9
"""Half width of a resonance, radians a sample, that frequencies are grouped about."""


@dataclass(frozen=True, eq=False)
class ResponsesInFrequency:
    """`z` (frequencies,) on the unit circle, `scale` (frequencies,) the square root of the power there over
    the noise, `left` (frequencies,) the response that the estimate leaves to the weights and the integrator.
    """

    rounding: ClassVar[float] = 1e-10
    """Of products scaled to unit diagonal, added to it: responses that all but coincide."""

    axis: AxisParameters
    z: ComplexArray
    scale: FloatArray
    left: ComplexArray

    @classmethod
    def of(
        cls,
        axis: AxisParameters,
        values: FloatArray,
        noise: NoiseEstimate,
        records: Sequence[Record],
        power: float,
    ) -> ResponsesInFrequency:
        """At an estimate `values` (parameters,) and the noise there, the likelihood to a `power`."""
        pairs = axis.linear_batch(values[:, None]).pair_poles[:, 0]
        z, strength = _grouped_spectrum(values[0], values[1], pairs, noise, records)
        left = axis.linear_batch(values[:, None]).frequency_response(np.angle(z) / (2 * np.pi), 1.0, 0)[0]
        return cls(axis, z, np.sqrt(power * strength), left)

    def __call__(
        self, batch: LinearBatch | ResidueBatch, per_sample: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Responses (points, weights, equations) to a weight of one, and what the integrator of `per_sample`
        (points,) leaves to them (points, equations)."""
        real_poles = np.ascontiguousarray(batch.real_poles[self.axis.free_real].T)
        count, equations = len(self.axis.weight_rows), 2 * len(self.z)
        rows = np.empty((len(per_sample), count, equations))
        wanted = np.empty((len(per_sample), equations))
        _fill(
            real_poles,
            np.ascontiguousarray(batch.pair_poles.real.T),
            np.ascontiguousarray(batch.pair_poles.imag.T),
            per_sample,
            self.z.real.copy(),
            self.z.imag.copy(),
            self.scale,
            np.concatenate([self.left.real, self.left.imag]),
            rows,
            wanted,
        )
        return rows, wanted


@compiled(nogil=True)
def _fill(  # type: ignore[no-untyped-def]
    real_poles, pair_real, pair_imag, per_sample, z_real, z_imag, scale, left, every, all_wanted
):
    """Responses `every` (points, n, equations) and `all_wanted` (points, equations) in place."""
    n_real, bins = real_poles.shape[1], len(scale)
    n = every.shape[1]
    for k in range(len(every)):
        rows, wanted = every[k], all_wanted[k]
        run_real, run_imag = scale.copy(), np.zeros(bins)
        for i in range(n_real):
            for f in range(bins):
                away = z_real[f] - real_poles[k, i]
                size = 1 / (away * away + z_imag[f] * z_imag[f])
                real = (run_real[f] * away + run_imag[f] * z_imag[f]) * size
                run_imag[f] = (run_imag[f] * away - run_real[f] * z_imag[f]) * size
                run_real[f] = real
            rows[i, :bins], rows[i, bins:] = run_real, run_imag
        row = n_real
        for i in range(pair_real.shape[1]):
            middle, aside = pair_real[k, i], pair_imag[k, i]
            for f in range(bins):
                away = z_real[f] - middle
                real = away * away - z_imag[f] * z_imag[f] + aside * aside
                imag = 2 * away * z_imag[f]
                size = scale[f] / (real * real + imag * imag)
                rows[row, f] = (away * real + z_imag[f] * imag) * size
                rows[row, bins + f] = (z_imag[f] * real - away * imag) * size
                rows[row + 1, f] = aside * real * size
                rows[row + 1, bins + f] = -aside * imag * size
            row += 2
        if row < n:
            rows[row, :bins], rows[row, bins:] = scale, 0.0
        for f in range(bins):
            away = z_real[f] - 1
            size = per_sample[k] / (away * away + z_imag[f] * z_imag[f])
            wanted[f] = scale[f] * (left[f] - away * size)
            wanted[bins + f] = scale[f] * (left[bins + f] + z_imag[f] * size)


def _grouped_spectrum(
    lower: float, upper: float, pairs: ComplexArray, noise: NoiseEstimate, records: Sequence[Record]
) -> tuple[ComplexArray, FloatArray]:
    """Points on the unit circle and the power of the commands there over the noise, (groups,) each."""
    angles, powers = [], []
    for record in records:
        spectrum = np.fft.rfft(np.clip(record.u, lower, upper))[1:]
        angle = 2 * np.pi * np.arange(1, len(spectrum) + 1) / len(record)
        whitener = 1 - sum(
            phi * np.exp(-1j * angle * lag) for lag, phi in enumerate(noise.autoregression, start=1)
        )
        angles.append(angle)
        powers.append(2 * np.abs(spectrum * whitener) ** 2 / (len(record) * noise.innovation_sigma**2))
    angle, power = np.concatenate(angles), np.concatenate(powers)
    place = GROUPS * np.log(angle / angle.min()) / np.log(np.pi / angle.min())
    for pole in np.log(pairs):
        place += (
            GROUPS_OF_A_PAIR / np.pi * np.arctan((angle - abs(pole.imag)) / max(abs(pole.real), NARROWEST))
        )
    _, group = np.unique(np.floor(place), return_inverse=True)
    total = np.bincount(group, power)
    centre = np.bincount(group, power * angle) / np.where(total > 0, total, 1.0)
    return np.exp(1j * centre[total > 0]), np.asarray(total[total > 0], dtype=np.float64)
