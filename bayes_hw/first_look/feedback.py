"""Whether the command listens to the noise of the output, as that of a closed loop does."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import autoregression_from_partial, burg, whitened

ORDER = 10
RATE_HZ = 25.0
FEEDBACK_LAGS = 20
FEEDBACK_SIGMAS = 5.0
FEEDBACK_LEAST = 0.1
"""Smallest correlation that is a loop's: what a linear response leaves of a long record correlates by a few
hundredths."""

ARX, HEARD_LAGS = 20, 5
"""Steps of the past that a reading is predicted from, and commands after it."""

HEARD_LEAST = 0.1
"""Smallest share that is a loop's: what is not linear in an axis leaves 0.08 at most."""

MOST_SAMPLES = 24_000


@dataclass(frozen=True)
class Feedback:
    """Largest correlation of the command with the noise before it, and how many standard deviations that
    is; `of_response` is the largest with what comes after: of an axis that is not linear the command explains
    errors to come, and by its own memory those that were.

    `heard` is the share of what each reading tells beyond the readings and commands before it that the
    commands after it hold: those of a drive that measures the axis itself answer within samples.
    """

    correlation: float
    lag_s: float
    sigmas: float
    of_response: float
    heard: float

    @property
    def closed_loop(self) -> bool:
        if self.heard > HEARD_LEAST:
            return True
        least = max(FEEDBACK_LEAST, abs(self.of_response))
        return self.sigmas > FEEDBACK_SIGMAS and abs(self.correlation) > least


def feedback(
    errors: Sequence[FloatArray],
    commands: Sequence[FloatArray],
    sample_rate_hz: float,
    outputs: Sequence[FloatArray],
) -> Feedback | None:
    """Errors of the linear response and commands, both whitened by autoregressions, so that their own memory
    is no correlation; and the `outputs` themselves, NaN where nothing was measured."""
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
        heard(outputs, commands),
    )


def heard(outputs: Sequence[FloatArray], commands: Sequence[FloatArray]) -> float:
    """Share of the innovations of outputs (samples,), given outputs and commands before them, that the
    HEARD_LAGS commands after them explain (Sims 1972, "Money, income, and causality", Am. Econ. Rev. 62,
    540-552)."""
    tables, targets, left = [], [], MOST_SAMPLES
    width = ARX + HEARD_LAGS + 2
    for y, u in zip(outputs, commands, strict=True):
        steps, command = np.diff(y[:left]), u[:left] / (float(np.std(u)) or 1.0)
        left -= len(command)
        if len(steps) < 4 * width:
            continue
        around = sliding_window_view(command, width)
        before = sliding_window_view(steps, ARX + 1)[: len(around)]
        scale = float(np.nanstd(steps)) or 1.0
        rows = np.concatenate([around, before[:, :-1] / scale, np.ones((len(before), 1))], axis=1)
        known = np.isfinite(before).all(axis=1)
        tables.append(rows[known])
        targets.append(before[known, -1] / scale)
    if not tables:
        return 0.0
    table, target = np.concatenate(tables), np.concatenate(targets)
    later = np.arange(ARX + 2, width)
    past = np.delete(table, later, axis=1)
    without, given = (float(np.sum((target - t @ _solved(t, target)) ** 2)) for t in (past, table))
    return 1 - given / without if without > 0 else 0.0


def _solved(table: FloatArray, target: FloatArray) -> FloatArray:
    return np.asarray(np.linalg.lstsq(table, target, rcond=1e-9)[0])


def _white(values: FloatArray) -> FloatArray:
    increments = np.diff(values)
    if not increments.std() > 0:
        return np.zeros(max(len(increments) - ORDER, 0))
    partial, _ = burg([increments], ORDER)
    weights = autoregression_from_partial(partial[:, None])[:, 0]
    return whitened(increments, weights)
