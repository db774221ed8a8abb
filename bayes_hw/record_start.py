"""Where a record begins: the angle that it counts from, and whether the axis is at rest there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from bayes_hw.arrays import FloatArray

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

SURELY_MOVING = 0.3
"""Share of the command's root mean square that has to have gone before for a record to begin in motion."""

SHARE_EXPLAINED = 0.5
"""Of what a start at rest leaves of the first stretch, that a start in motion has to explain."""

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


def record_start(u: FloatArray, y: FloatArray, rate_hz: float) -> RecordStart:
    """What the beginning of command and angle, both (samples,), says.

    The level is the mean over the samples during which the command cannot have moved the axis by more than
    the noise; where these are fewer than three and the first is an outlier, the median of the first three.
    """
    noise = reading_noise(y)
    samples = _samples_at_rest(u, y, rate_hz, noise)
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
    """Whether the first stretch shows speed that no command of the record has caused.

    The response from command to speed, learnt from the rest of the record, predicts the first stretch from
    rest; the axis moves where a constant command before the record explains most of what that leaves.
    """
    width = max(int(np.ceil(RESPONSE_S * rate_hz / RESPONSE_TAPS)), 1)
    taps = max(round(RESPONSE_S * rate_hz / width), 4)
    blocks = len(u) // width
    if blocks < (FEWEST_ROWS_A_TAP + 1) * taps:
        return False
    command = u[: blocks * width].reshape(blocks, width).mean(axis=1)
    angle = y[: blocks * width].reshape(blocks, width).mean(axis=1)
    steps = np.diff(angle)
    usual = float(np.mean(command**2))
    if usual == 0 or not np.any(steps):
        return False
    rows = sliding_window_view(command, taps)[:, ::-1]
    shown, answer = rows[1:], steps[taps - 1 :]
    square = shown.T @ shown + RIDGE * usual * len(shown) * np.eye(taps)
    response = np.linalg.solve(square, shown.T @ answer)
    padded = np.concatenate([np.zeros(taps - 1), command[: taps + 1]])
    from_rest = sliding_window_view(padded, taps)[1 : taps + 1, ::-1] @ response
    before = np.concatenate([np.ones(taps - 1), np.zeros(taps + 1)])
    of_past = sliding_window_view(before, taps)[1 : taps + 1, ::-1] @ response
    moved = np.cumsum(steps[:taps])
    unexplained = moved - np.cumsum(from_rest)
    shape = np.cumsum(of_past)
    size = float(shape @ shape)
    if _moves_before_any_command(command, steps) or size == 0:
        return size > 0
    past = float(shape @ unexplained) / size
    explained = past**2 * size / max(float(unexplained @ unexplained), 1e-300)
    farther = past * float(shape @ moved) > 0
    beyond = float(np.mean(np.abs(moved))) > BEYOND_NOISE * reading_noise(angle)
    return farther and beyond and explained > SHARE_EXPLAINED and past**2 > SURELY_MOVING**2 * usual


def _moves_before_any_command(command: FloatArray, steps: FloatArray) -> bool:
    """Whether the angle runs on, at a fair share of its usual speed, while the command has been zero."""
    idle = int(np.flatnonzero(command)[0]) if np.any(command) else len(command)
    if idle < 4:
        return False
    usual = float(np.sqrt(np.mean(steps**2)))
    return abs(float(np.mean(steps[: min(idle, RESPONSE_TAPS) - 1]))) > IDLE_SHARE * usual
