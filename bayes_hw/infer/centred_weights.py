"""Coordinates in which the weights of G's poles no longer follow the poles.

The response is linear in the weights. Given the poles p and the gain g of an integrator, least squares puts
the weights at w(p, g) = A(p)^-1 (Phi(p)^T r(g) + D m) with precision A(p) = Phi(p)^T Phi(p) + D: Phi are the
responses of the poles to the commands, r is what the estimate leaves to them, and D and m are precision and
mean of the prior. Both turn quickly where poles lie close together or a weight is hardly told from none, and
a posterior of weights and poles is then a bent ridge or a funnel. In the coordinates

    c = L(p)^T (weights - w(p, g)),    L L^T = A(p)

c is nearly standard normal whatever the poles are: the separation of variables of Golub and Pereyra
(doi 10.1088/0266-5611/19/2/201), with the weights kept. The map is one to one and its Jacobian is
exact, so that the density is as it was; what is approximate, products over frequencies under the spectrum of
the commands inside the limits of the estimate over that of its noise, decides only how straight it becomes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import ParameterVector
from bayes_hw.record import Record

GROUPS, GROUPS_OF_A_PAIR = 40, 8
"""Of frequencies: over the whole band evenly in their logarithms, and more about the resonance of a pair."""
NARROWEST = 1e-9
"""Half width of a resonance, radians a sample, that frequencies are grouped about."""
POINTS_AT_ONCE = 512
ROUNDING = 1e-10
"""Of a precision scaled to unit diagonal, added to it: responses that all but coincide."""


@dataclass(frozen=True, eq=False)
class CentredWeights:
    """The map between these coordinates and those of the parameters, for points (..., parameters).

    `z` (frequencies,) on the unit circle, `scale` (frequencies,) the square root of the power there over the
    noise, `left` (frequencies,) the response that the estimate leaves to the weights and the integrator.
    """

    axis: AxisParameters
    rows: tuple[int, ...]
    gain_row: int | None
    z: ComplexArray
    scale: FloatArray
    left: ComplexArray
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
    ) -> CentredWeights | None:
        """For an axis, an estimate of its parameters (parameters,), more of them are not looked at, the noise
        there and the power of the likelihood; None where no weight is free."""
        values = values[: len(axis.parameters)]
        rows = axis.weight_rows
        if not rows:
            return None
        priors = [found for row in rows if (found := axis.parameters[row].prior.of_value) is not None]
        gain_row = axis.names.index("velocity_gain") if "velocity_gain" in axis.names else None
        pairs = axis.linear_batch(values[:, None]).pair_poles[:, 0]
        z, strength = _grouped_spectrum(values[0], values[1], pairs, noise, records)
        left = axis.linear_batch(values[:, None]).frequency_response(np.angle(z) / (2 * np.pi), 1.0, 0)[0]
        return cls(
            axis,
            rows,
            gain_row,
            z,
            np.sqrt(power * strength),
            left,
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
                np.ascontiguousarray(batch.real_poles[self.axis.free_real].T),
                np.ascontiguousarray(batch.pair_poles.real.T),
                np.ascontiguousarray(batch.pair_poles.imag.T),
                self._per_sample(values),
                self.z.real.copy(),
                self.z.imag.copy(),
                self.scale,
                np.concatenate([self.left.real, self.left.imag]),
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


@njit(cache=True, nogil=True, error_model="numpy")
def _move(  # type: ignore[no-untyped-def]
    real_poles,
    pair_real,
    pair_imag,
    per_sample,
    z_real,
    z_imag,
    scale,
    left,
    precision,
    mean,
    plain,
    weights,
    log_jacobian,
):
    """Weights (points, n) moved in place, and the log-Jacobian (points,) of going to plain ones."""
    n_real, bins = real_poles.shape[1], len(scale)
    n = weights.shape[1]
    rows, wanted = np.empty((n, 2 * bins)), np.empty(2 * bins)
    for k in range(len(weights)):
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
        lower, centre = np.dot(rows, rows.T), np.dot(rows, wanted)
        logarithm = 0.0
        for i in range(n):
            centre[i] += precision[i] * mean[i]
            lower[i, i] = (lower[i, i] + precision[i]) * (1 + ROUNDING)
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
