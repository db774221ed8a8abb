"""The offset between two clocks, from a signal that both log.

    a(t) = level + factor b(t + offset) + e(t),

each on its own clock: least squares over all three, the offset first on a grid. The standard deviation is
that of a regression whose errors are correlated: Newey and West, Econometrica 55 (1987) 703, doi
10.2307/1913610.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError

LARGEST_S = 5.0
"""Offsets are sought up to so many s, or a quarter of the record."""

FEWEST_SAMPLES = 100
PROBIT = 1.8808
"""Of 97 %: 94 % lie within so many standard deviations."""

COARSE_SAMPLES = 500
ROUNDS = 30
LEAST_CORRELATION = 0.8


class ClockOffset(NamedTuple):
    """Seconds that the second clock is ahead, with standard deviation, and how well the signals agree."""

    seconds: float
    sd: float
    correlation: float

    @property
    def interval(self) -> tuple[float, float]:
        """That of 94 %."""
        return self.seconds - PROBIT * self.sd, self.seconds + PROBIT * self.sd


def clock_offset(t: FloatArray, a: FloatArray, when: FloatArray, b: FloatArray) -> ClockOffset:
    """The offset of the clock `when` (m,) of `b` ahead of the clock `t` (n,) of `a`, in s; NaN are left out.

    Raises InputError where the signals are too short, do not move, or do not agree at any offset.
    """
    t, a = t[np.isfinite(a)], a[np.isfinite(a)]
    when, b = when[np.isfinite(b)], b[np.isfinite(b)]
    if min(len(t), len(when)) < FEWEST_SAMPLES or np.ptp(a) == 0 or np.ptp(b) == 0:
        raise InputError("the signal is too short, or does not move: no offset of clocks follows from it")
    step = min(float(np.median(np.diff(t))), float(np.median(np.diff(when))))
    reach = min(LARGEST_S, (t[-1] - t[0]) / 4)
    grid = np.arange(-int(reach / step), int(reach / step) + 1) * step
    some = slice(None, None, max(len(t) // COARSE_SAMPLES, 1))
    found = max(grid, key=lambda offset: abs(_agreement(t[some], a[some], when, b, float(offset))))
    offset, width = float(found), step
    for _ in range(ROUNDS):
        around = [offset - width, offset, offset + width]
        offset = max(around, key=lambda tried: abs(_agreement(t, a, when, b, tried)))
        width *= 0.7
    agreement = _agreement(t, a, when, b, offset)
    if abs(agreement) < LEAST_CORRELATION:
        raise InputError(
            f"the two signals agree at no offset of the clocks within {reach:.3g} s (correlation "
            f"{agreement:.2f} at best): name a column that both files log"
        )
    return ClockOffset(offset, _deviation(t, a, when, b, offset), agreement)


def _at(t: FloatArray, when: FloatArray, b: FloatArray, offset: float) -> tuple[FloatArray, FloatArray]:
    """Which of `t` the other clock reaches, and b there."""
    shifted = t + offset
    inside = (shifted >= when[0]) & (shifted <= when[-1])
    return inside, np.interp(shifted[inside], when, b)


def _agreement(t: FloatArray, a: FloatArray, when: FloatArray, b: FloatArray, offset: float) -> float:
    inside, there = _at(t, when, b, offset)
    if int(inside.sum()) < FEWEST_SAMPLES:
        return 0.0
    x, y = a[inside] - a[inside].mean(), there - there.mean()
    size = float(x @ x) * float(y @ y)
    return float(x @ y) / float(np.sqrt(size)) if size > 0 else 0.0


def _deviation(t: FloatArray, a: FloatArray, when: FloatArray, b: FloatArray, offset: float) -> float:
    """Standard deviation of the offset, that of interpolation between samples of b included."""
    inside, there = _at(t, when, b, offset)
    step = float(np.median(np.diff(when)))
    _, before = _at(t[inside], when, b, offset - step / 2)
    _, after = _at(t[inside], when, b, offset + step / 2)
    length = min(len(there), len(before), len(after))
    table = np.column_stack([np.ones(length), there[:length]])
    factors = np.linalg.lstsq(table, a[inside][:length], rcond=None)[0]
    error = a[inside][:length] - table @ factors
    slope = factors[1] * (after[:length] - before[:length]) / step
    slope = slope - table @ np.linalg.lstsq(table, slope, rcond=None)[0]
    score = error * slope
    lags = int(4 * (length / 100) ** (2 / 9)) + 1
    spread = float(score @ score)
    for lag in range(1, lags + 1):
        spread += 2 * (1 - lag / (lags + 1)) * float(score[lag:] @ score[:-lag])
    return float(np.sqrt(max(spread, 0.0))) / max(float(slope @ slope), np.finfo(float).tiny)
