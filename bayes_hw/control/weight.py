"""A stable weight of low order that lies above a given magnitude and no higher than it must."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import optimize

from bayes_hw.arrays import ComplexArray, FloatArray

SOFTNESS = 60.0
"""The soft maximum of the search is within log(points) / SOFTNESS of the maximum."""

DESCENT_STEPS = 60
LARGEST_DAMPING, SMALLEST_DAMPING = 3.0, 5e-3


@dataclass(frozen=True, eq=False)
class Weight:
    """W(z) = gain times sections ((x + z_i) / (x + p_i) or second-order ones) in x, the bilinear frequency.

        x = (2 / T) (z - 1) / (z + 1)

    `zeros` and `poles` are in x, rad/s, with negative real parts: W is stable and so is its inverse.
    """

    gain: float
    zeros: ComplexArray
    poles: ComplexArray
    sample_rate_hz: float

    @property
    def order(self) -> int:
        return len(self.poles)

    def magnitude(self, frequency_hz: FloatArray) -> FloatArray:
        """|W(exp(2 pi i f / rate))|, same shape as `frequency_hz`."""
        x = 1j * _warped(frequency_hz, self.sample_rate_hz)
        found = np.full(np.shape(frequency_hz), self.gain)
        for zero, pole in zip(self.zeros, self.poles, strict=True):
            found = found * np.abs(x - zero) / np.abs(x - pole)
        return found

    def transfer_function(self) -> tuple[FloatArray, FloatArray]:
        """Numerator and denominator in powers of 1/z, constant term first, the denominator's being one."""
        t = 2 * self.sample_rate_hz
        zeros, poles = (t + self.zeros) / (t - self.zeros), (t + self.poles) / (t - self.poles)
        gain = self.gain * np.prod((t - self.zeros) / (t - self.poles)).real
        return np.atleast_1d(gain * np.poly(zeros).real), np.atleast_1d(np.poly(poles).real)


def fit_weight(frequency_hz: FloatArray, floor: FloatArray, order: int, sample_rate_hz: float) -> Weight:
    """The weight of `order` 1 to 3 with |W| >= floor at every frequency and the smallest mean of log(|W| /
    floor).

    `frequency_hz`, `floor` (frequencies,), the mean over the logarithm of frequency. The shape is found from
    several starts; the gain is then the smallest that touches `floor`.
    """
    x = _warped(frequency_hz, sample_rate_hz)
    target = np.log(np.maximum(floor, 1e-12 * floor.max()))
    step = np.gradient(np.log(frequency_hz))
    share = step / step.sum()

    def shape(parameters: FloatArray) -> FloatArray:
        return _log_magnitude(parameters, order, x)[0]

    def cost(parameters: FloatArray) -> tuple[float, FloatArray]:
        """The soft maximum of the distance less its mean, and its gradient."""
        values, slopes = _log_magnitude(parameters, order, x)
        distance = target - values
        top = float(distance.max())
        size = np.exp(SOFTNESS * (distance - top))
        soft = top + float(np.log(np.mean(size))) / SOFTNESS
        return soft - float(share @ distance), slopes @ (share - size / size.sum())

    def exact(parameters: FloatArray) -> float:
        distance = target - shape(parameters)
        return float(distance.max() - share @ distance)

    bounds = _bounds(order, x)
    best = min(
        (
            optimize.minimize(
                cost, start, jac=True, method="L-BFGS-B", bounds=bounds, options={"maxiter": DESCENT_STEPS}
            ).x
            for start in _starts(order, x, target)
        ),
        key=exact,
    )
    polished = optimize.minimize(
        exact, best, method="Nelder-Mead", bounds=bounds, options={"maxiter": 400 * order, "xatol": 1e-4}
    )
    best = polished.x if polished.fun < exact(best) else best
    zeros, poles = _roots(best, order)
    gain = float(np.exp(np.max(target - shape(best))))
    return Weight(gain * (1 + 1e-12), zeros, poles, sample_rate_hz)


def _log_magnitude(parameters: FloatArray, order: int, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """log |W| of unit gain at infinity (points,) and its derivatives (parameters, points).

    The parameters are log frequencies and log dampings, see `_roots`.
    """
    total, slopes = np.zeros_like(x), np.zeros((len(parameters), len(x)))
    if order >= 2:
        for first, sign in ((0, 1.0), (2, -1.0)):
            frequency, damping = np.exp(parameters[first : first + 2])
            inner, outer = frequency**2 - x**2, (2 * damping * frequency * x) ** 2
            size = inner**2 + outer
            total += sign * 0.5 * np.log(size)
            slopes[first] = sign * (2 * frequency**2 * inner + outer) / size
            slopes[first + 1] = sign * outer / size
    if order % 2:
        for row, sign in ((-2, 1.0), (-1, -1.0)):
            corner = np.exp(parameters[row])
            size = x**2 + corner**2
            total += sign * 0.5 * np.log(size)
            slopes[row] = sign * corner**2 / size
    return total, slopes


def _roots(parameters: FloatArray, order: int) -> tuple[ComplexArray, ComplexArray]:
    zeros: list[complex] = []
    poles: list[complex] = []
    if order >= 2:
        frequency_n, damping_n, frequency_d, damping_d = np.exp(parameters[:4])
        zeros += _pair(frequency_n, damping_n)
        poles += _pair(frequency_d, damping_d)
    if order % 2:
        zeros.append(complex(-np.exp(parameters[-2])))
        poles.append(complex(-np.exp(parameters[-1])))
    return np.array(zeros, dtype=np.complex128), np.array(poles, dtype=np.complex128)


def _pair(frequency: float, damping: float) -> list[complex]:
    root = np.sqrt(complex(damping**2 - 1))
    return [complex(frequency * (-damping + root)), complex(frequency * (-damping - root))]


def _bounds(order: int, x: FloatArray) -> list[tuple[float, float]]:
    frequency = (float(np.log(x[0] / 3)), float(np.log(x[-1] * 3)))
    damping = (float(np.log(SMALLEST_DAMPING)), float(np.log(LARGEST_DAMPING)))
    pair = [frequency, damping, frequency, damping] if order >= 2 else []
    return pair + ([frequency, frequency] if order % 2 else [])


def _starts(order: int, x: FloatArray, target: FloatArray) -> list[FloatArray]:
    """Corners spread over the band, and a resonance where the target is highest above its ends."""
    log_x = np.log(x)
    line = np.interp(log_x, [log_x[0], log_x[-1]], [target[0], target[-1]])
    peak = float(log_x[np.argmax(target - line)])
    middles = np.quantile(log_x, [0.25, 0.5, 0.75, 0.9])
    starts = []
    for middle in (*middles, peak):
        for gap in (-0.7, 0.7):
            pair = [[middle + gap, 0.0, middle - gap, 0.0], [peak, -1.0, peak, -2.5]] if order >= 2 else [[]]
            single = [middle + gap, middle - gap] if order % 2 else []
            starts += [np.array([*p, *single]) for p in pair]
    return starts


def _warped(frequency_hz: FloatArray, sample_rate_hz: float) -> FloatArray:
    """The bilinear frequency in rad/s; half the sample rate, which it sends to infinity, is held just
    below."""
    angle = np.minimum(np.pi * np.asarray(frequency_hz) / sample_rate_hz, np.pi / 2 * (1 - 1e-4))
    return np.asarray(2 * sample_rate_hz * np.tan(angle), dtype=np.float64)
