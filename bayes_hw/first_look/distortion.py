"""What of the output's rate is neither linear in the command nor noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from bayes_hw.arrays import FloatArray

LAGS = 20
RATE_HZ = 25.0
MOST_SAMPLES = 12_000


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
