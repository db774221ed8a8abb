"""Where a record begins: the angle that it counts from, and whether the axis is at rest there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from bayes_hw.arrays import BoolArray, FloatArray

SECOND_DIFFERENCE_SD = np.sqrt(6.0)
"""Standard deviation of second differences of white noise of sd one."""

NORMAL_MEDIAN = 0.6745
"""Median of the absolute value of a standard normal number."""

FEWEST_REST_SAMPLES = 10
"""Fewer samples at rest give a level that is hardly better known than a single reading."""

BEYOND_NOISE = 8.0
"""A level so many noise deviations from zero is none of the noise; coloured noise has larger excursions than
its second differences say."""

RESPONSE_S = 1.5
"""Length of the response from command to speed that is estimated."""

RESPONSE_TAPS = 30
FEWEST_ROWS_A_TAP = 4
RIDGE = 1e-3
"""Of the mean square of the command, times the rows: keeps a response that the command hardly shows small."""

AT_ONCE_S = 0.4
"""Within so many seconds an angle in motion must have gone clear of the noise."""

STRAIGHT_BEYOND_NOISE = 12.0
"""Noise deviations to go before it can be told whether an angle goes straight."""

STRAIGHT = 0.7
"""Of the way in the second half of a stretch, that an angle in motion has gone in the first; an axis that
gathers speed has gone a third."""

FAIR_SHARE = 0.4
"""Of the record's usual speed, that a motion at the beginning has."""

IDLE_SHARE = 0.2
"""Of the record's usual speed: faster before the first command is motion."""


@dataclass(frozen=True)
class RecordStart:
    """The beginning of a record: level of its angle with standard deviation (output units), the samples that
    it is the mean of, the noise of one of them, and whether the axis moves there."""

    level: float
    level_sd: float
    samples: int
    noise: float
    moving: bool

    @property
    def is_zero(self) -> bool:
        """Whether the level is zero within the noise."""
        return abs(self.level) <= BEYOND_NOISE * self.noise


def record_start(
    u: FloatArray, y: FloatArray, rate_hz: float, measured: BoolArray | None = None
) -> RecordStart:
    """What the beginning of command and angle, both (samples,), says; where nothing was `measured` there, the
    level is that of the first reading, as uncertain as the record is long, the mean of no samples.

    The level is the mean over the samples during which the command cannot have moved the axis by more than
    the noise; where these are fewer than three and the first is an outlier, the median of the first three.
    """
    noise = reading_noise(y)
    samples = _samples_at_rest(u, y, rate_hz, noise)
    if measured is not None and not measured[:samples].any():
        return RecordStart(float(y[0]), float(np.ptp(y)), 0, noise, begins_in_motion(u, y, rate_hz))
    level = float(np.mean(y[:samples]))
    if samples < 3 and abs(level - float(np.median(y[:3]))) > BEYOND_NOISE * noise:
        samples, level = 3, float(np.median(y[:3]))
    if samples >= FEWEST_REST_SAMPLES:
        noise = max(noise, float(np.std(y[:samples])))
    moving = begins_in_motion(u, y, rate_hz)
    return RecordStart(level, noise / float(np.sqrt(samples)), samples, noise, moving)


def reading_noise(y: FloatArray) -> float:
    """Standard deviation of the noise of one reading, from second differences; at least that of rounding."""
    second = np.abs(np.diff(y, 2))
    white = float(np.median(second)) / (NORMAL_MEDIAN * float(SECOND_DIFFERENCE_SD)) if len(second) else 0.0
    steps = np.abs(np.diff(y))
    moved = steps[steps > 0]
    return max(white, float(moved.min()) / np.sqrt(12.0) if len(moved) else 0.0)


def _samples_at_rest(u: FloatArray, y: FloatArray, rate_hz: float, noise: float) -> int:
    """Samples, one at least, before the command can have moved the axis by more than the noise."""
    usual = float(np.sqrt(np.mean(u**2)))
    if usual == 0:
        return 1
    blocks = max(len(y) // max(round(RESPONSE_S * rate_hz), 1), 1)
    ends = np.linspace(0, len(y) - 1, blocks + 1).astype(int)
    speed = np.diff(y[ends]) * rate_hz / np.maximum(np.diff(ends), 1)
    per_command = float(np.sqrt(np.mean(speed**2))) / usual
    travel = np.concatenate([[0.0], np.cumsum(np.abs(u[:-1]))]) / rate_hz * per_command
    return max(int(np.searchsorted(travel, noise, side="right")), 1)


def begins_in_motion(u: FloatArray, y: FloatArray, rate_hz: float) -> bool:
    """Whether the axis moves before a command of the record can have moved it.

    That is so where the angle runs on without any command, or runs straight off from the first sample on and
    not as an axis that gathers speed, farther than the noise, on an axis that takes time to answer.
    """
    if _moves_before_any_command(u, y, rate_hz):
        return True
    speed = _speed_at_once(y, rate_hz)
    if speed == 0:
        return False
    return abs(speed) * _answering_time(u, y, rate_hz) > reading_noise(y)


def _moves_before_any_command(u: FloatArray, y: FloatArray, rate_hz: float) -> bool:
    """Whether the angle runs on, at a fair share of its usual speed, while the command has been zero."""
    idle = int(np.flatnonzero(u)[0]) if np.any(u) else len(u)
    idle = min(idle, round(RESPONSE_S * rate_hz))
    if idle < FEWEST_REST_SAMPLES:
        return False
    thirds = y[: idle // 3 * 3].reshape(3, -1).mean(axis=1)
    first, second = np.diff(thirds) / (idle // 3)
    steady = min(first, second) if first > 0 else -max(first, second)
    moved = abs(float(thirds[2] - thirds[0]))
    return steady > IDLE_SHARE * _usual_step(y, rate_hz) and moved > BEYOND_NOISE * reading_noise(y)


def _usual_step(y: FloatArray, rate_hz: float) -> float:
    """Root mean square of the speed, per sample, over half seconds."""
    width = max(round(rate_hz / 2), 1)
    return float(np.sqrt(np.mean(np.diff(y[::width]) ** 2))) / width


def _speed_at_once(y: FloatArray, rate_hz: float) -> float:
    """Speed, per s, with which an angle goes off straight from its first sample; zero where it does not."""
    noise = reading_noise(y)
    longest = max(round(AT_ONCE_S * rate_hz), 4)
    clear = np.flatnonzero(np.abs(y[: longest + 1] - y[0]) > STRAIGHT_BEYOND_NOISE * noise)
    if not len(clear):
        return 0.0
    stop = max(int(clear[0]), 4)
    stop += stop % 2
    if stop > longest or stop >= len(y):
        return 0.0
    first, second = y[stop // 2] - y[0], y[stop] - y[stop // 2]
    straight = first * second > 0 and abs(first) > STRAIGHT * abs(second)
    step = float(y[stop] - y[0]) / stop
    return step * rate_hz if straight and abs(step) > FAIR_SHARE * _usual_step(y, rate_hz) else 0.0


def _answering_time(u: FloatArray, y: FloatArray, rate_hz: float) -> float:
    """Mean delay, in s, of the least-squares response from command to speed; zero in a short record."""
    width = max(int(np.ceil(RESPONSE_S * rate_hz / RESPONSE_TAPS)), 1)
    taps = max(round(RESPONSE_S * rate_hz / width), 4)
    blocks = len(u) // width
    if blocks < (FEWEST_ROWS_A_TAP + 1) * taps:
        return 0.0
    command = u[: blocks * width].reshape(blocks, width).mean(axis=1)
    steps = np.diff(y[: blocks * width].reshape(blocks, width).mean(axis=1))
    usual = float(np.mean(command**2))
    rows = sliding_window_view(command, taps)[1:, ::-1]
    square = rows.T @ rows + max(RIDGE * usual, 1e-300) * len(rows) * np.eye(taps)
    response = np.linalg.solve(square, rows.T @ steps[taps - 1 :])
    gain = float(response.sum())
    if gain == 0:
        return 0.0
    return abs(float(response @ np.arange(taps)) / gain) * width / rate_hz
