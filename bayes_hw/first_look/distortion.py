"""What of the output's rate is neither linear in the command nor noise, and whether the command listens to
the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import autoregression_from_partial, burg, whitened

LAGS = 20
ORDER = 10
RATE_HZ = 25.0
MOST_SAMPLES = 12_000
FEEDBACK_LAGS = 20
FEEDBACK_SIGMAS = 5.0
FEEDBACK_LEAST = 0.1
"""Smallest correlation that is a loop's: what a linear response leaves of a long record correlates by a few
hundredths.
"""


@dataclass(frozen=True)
class Distortion:
    """Shares of the power of the error's increments: explained by even and by odd powers of the command;
    adjusted R^2.
    """

    even: float
    odd: float


def distortion(
    errors: Sequence[FloatArray], commands: Sequence[FloatArray], sample_rate_hz: float
) -> Distortion | None:
    """Of what a linear response leaves; None where the records are too short."""
    factor = max(1, round(sample_rate_hz / RATE_HZ))
    largest = max(float(np.abs(u).max()) for u in commands) or 1.0
    tables, targets, left = [], [], MOST_SAMPLES
    for error, u in zip(errors, commands, strict=True):
        length = min(len(error) // factor, left)
        if length < 4 * LAGS:
            continue
        left -= length
        v = u[: length * factor].reshape(-1, factor).mean(axis=1) / largest
        rows = [sliding_window_view(f, LAGS)[:, ::-1] for f in (v, np.abs(v), v * np.abs(v))]
        tables.append(np.stack(rows))
        targets.append(np.diff(error[: length * factor : factor], prepend=error[0])[LAGS - 1 :])
    if not tables:
        return None
    table, target = np.concatenate(tables, axis=1), np.concatenate(targets)
    target = target - target.mean()
    linear, even, odd = table - table.mean(axis=1, keepdims=True)
    if len(target) < 6 * LAGS or not target @ target > 0:
        return None
    base = _explained(linear, target)
    return Distortion(
        max(_explained(np.hstack([linear, even]), target) - base, 0.0),
        max(_explained(np.hstack([linear, odd]), target) - base, 0.0),
    )


def _explained(table: FloatArray, target: FloatArray) -> float:
    fitted = table @ np.linalg.lstsq(table, target, rcond=1e-8)[0]
    rows, columns = table.shape
    left = float(np.sum((target - fitted) ** 2)) / max(rows - columns, 1)
    return 1 - left / (float(target @ target) / (rows - 1))


@dataclass(frozen=True)
class Feedback:
    """Largest correlation of the command with the noise before it, and how many standard deviations that
    is; `of_response` is the largest with what comes after: of an axis that is not linear the command explains
    errors to come, and by its own memory those that were.
    """

    correlation: float
    lag_s: float
    sigmas: float
    of_response: float

    @property
    def closed_loop(self) -> bool:
        least = max(FEEDBACK_LEAST, abs(self.of_response))
        return self.sigmas > FEEDBACK_SIGMAS and abs(self.correlation) > least


def feedback(
    errors: Sequence[FloatArray], commands: Sequence[FloatArray], sample_rate_hz: float
) -> Feedback | None:
    """Both whitened by autoregressions, so that their own memory is no correlation."""
    factor = max(1, round(sample_rate_hz / RATE_HZ))
    sums, after, rows = np.zeros(FEEDBACK_LAGS), np.zeros(FEEDBACK_LAGS), 0
    pairs = []
    for error, u in zip(errors, commands, strict=True):
        if len(u) < factor * 8 * FEEDBACK_LAGS:
            continue
        v = u[: len(u) // factor * factor].reshape(-1, factor).mean(axis=1)
        pairs.append((_white(error[::factor][: len(v)]), _white(v)))
    for noise, command in pairs:
        if not (noise.std() > 0 and command.std() > 0):
            continue
        noise, command = np.clip(noise / noise.std(), -4, 4), np.clip(command / command.std(), -4, 4)
        sums += [noise[:-lag] @ command[lag:] for lag in range(1, FEEDBACK_LAGS + 1)]
        after += [noise[lag:] @ command[: len(command) - lag] for lag in range(FEEDBACK_LAGS)]
        rows += len(noise)
    if rows == 0:
        return None
    best = int(np.argmax(np.abs(sums)))
    correlation = float(sums[best]) / rows
    return Feedback(
        correlation,
        (best + 1) * factor / sample_rate_hz,
        abs(correlation) * float(np.sqrt(rows)),
        float(np.abs(after).max()) / rows,
    )


def _white(values: FloatArray) -> FloatArray:
    increments = np.diff(values)
    if not increments.std() > 0:
        return np.zeros(max(len(increments) - ORDER, 0))
    partial, _ = burg([increments], ORDER)
    weights = autoregression_from_partial(partial[:, None])[:, 0]
    return whitened(increments, weights)
