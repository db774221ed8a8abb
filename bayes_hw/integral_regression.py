"""Whether an angle is moved by a command: its regression on the command's integral, behind a delay.

Spectra of short stretches lose their coherence to a delay, to limits and to noise of the angle, whose
difference is the speed; a whole record in levels does not. Two series that wander correlate by chance, so
what tells beside a large correlation is whether past commands predict the angle beyond its own past
(Granger, doi 10.2307/1912791).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray

MOST_SAMPLES = 3000
"""Longer records are averaged over blocks to so many."""

LONGEST_DELAY = 4
"""The longest delay is so small a part of the record."""

OWN_PAST = 20
"""Samples of its own past that predict an angle."""

AROUND = (-8, -4, -2, -1, 0, 1, 2, 4, 8, 16)
"""Samples off the delay at which the command's integral may predict it."""

BY_CHANCE_NATS = 18.0
"""Log-likelihood that past commands gain by chance at most: 17 in 360 records of white, slow, periodic and
wandering noise."""

CLOSE = 0.9
"""Correlation of the levels from which the one is said to move the other."""


class IntegralRegression(NamedTuple):
    """`correlation` of the levels, signed, linear trends taken out; `gain` in output units per s and unit of
    the command; `nats` of log-likelihood by which past commands predict the angle beyond its own past."""

    correlation: float
    gain: float
    nats: float

    @property
    def is_moved(self) -> bool:
        """Whether the command moves the angle."""
        return abs(self.correlation) > CLOSE or self.nats > BY_CHANCE_NATS


def integral_regression(command: FloatArray, angle: FloatArray, rate_hz: float) -> IntegralRegression:
    """Of `angle` (samples,) on the integral of `command` (samples,), at the delay of most correlation."""
    return _regression(np.cumsum(command) / rate_hz, angle)


def level_regression(command: FloatArray, angle: FloatArray) -> IntegralRegression:
    """Of `angle` (samples,) on `command` itself (samples,), as behind a position command or of a speed."""
    return _regression(command, angle)


def _regression(cause: FloatArray, angle: FloatArray) -> IntegralRegression:
    width = -(-len(angle) // MOST_SAMPLES)
    blocks = len(angle) // width
    x, y = (one[: blocks * width].reshape(blocks, width).mean(axis=1) for one in (cause, angle))
    moved, level = _without_trend(x), _without_trend(y)
    product = np.fft.irfft(np.fft.rfft(moved, 2 * blocks).conj() * np.fft.rfft(level, 2 * blocks), 2 * blocks)
    delay = int(np.argmax(np.abs(product[: max(blocks // LONGEST_DELAY, 1)])))
    before, after = moved[: blocks - delay], level[delay:]
    before, after = before - before.mean(), after - after.mean()
    power, way = float(before @ before), float(after @ after)
    if power == 0 or way == 0:
        return IntegralRegression(0.0, 0.0, 0.0)
    both = float(before @ after)
    return IntegralRegression(both / np.sqrt(power * way), both / power, _predicted(x, y, delay))


def _predicted(cause: FloatArray, angle: FloatArray, delay: int) -> float:
    """Nats that `cause` about `delay` samples before gains over the past of `angle` alone."""
    first = max(OWN_PAST, delay + max(AROUND)) + 1
    samples = np.arange(first, len(angle))
    if len(samples) < 2 * (OWN_PAST + len(AROUND)):
        return 0.0
    own = [angle[samples - lag] for lag in range(1, OWN_PAST + 1)]
    known = [np.ones(len(samples)), np.linspace(-1.0, 1.0, len(samples)), *own]
    past = [cause[samples - delay - lag] for lag in AROUND if delay + lag >= 0]
    alone, beside = (_left(angle[samples], columns) for columns in (known, [*known, *past]))
    return 0.5 * len(samples) * float(np.log(alone / beside)) if beside > 0 else 0.0


def _left(target: FloatArray, columns: list[FloatArray]) -> float:
    """Sum of squares that columns of unit length leave of `target`."""
    matrix = np.stack([column / max(float(np.linalg.norm(column)), 1e-300) for column in columns], axis=1)
    found = np.linalg.lstsq(matrix, target, rcond=1e-10)[0]
    return float(np.sum((target - matrix @ found) ** 2))


def _without_trend(one: FloatArray) -> FloatArray:
    time = np.linspace(-1.0, 1.0, len(one))
    slope = float(time @ one) / float(time @ time)
    return np.asarray(one - one.mean() - slope * time)
