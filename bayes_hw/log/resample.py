"""Putting columns on a uniform grid of another rate."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.errors import InputError
from bayes_hw.log.time_stamps import GAP_STEPS, STEP_TOLERANCE, gaps, is_uniform, mean_rate

MOST_SAMPLES = 10_000_000


def resample_columns(
    t: FloatArray, u: FloatArray, y: FloatArray, rate_hz: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Columns on the grid t[0] + k / rate_hz, up to the last stamp; all have shape (samples,).

    `t` increases, in s, and may be uneven. The command is what the drive held: each u lasts until
    the next stamp (the last one without end), and the new u[k] is its mean over [t_k, t_k+1), so
    that an integrator sees the same area. The new y[k] is y at t_k, interpolated linearly. No
    anti-alias filter acts on y, which would smear the response past t_k: decimating does not
    lower its noise, and content above half the new rate folds down.

    Raises InputError when the rate is not positive or gives fewer than 2 or more than 10,000,000
    samples.
    """
    if not (math.isfinite(rate_hz) and rate_hz > 0):
        raise InputError(f"--resample {rate_hz!r}: give a positive rate in Hz")
    s = t - t[0]
    periods = float(s[-1]) * rate_hz
    if not 1 <= periods + 1e-6 < MOST_SAMPLES:
        raise InputError(
            f"--resample {rate_hz:g}: {s[-1]:g} s at this rate are {periods + 1:.4g} samples; "
            f"choose a rate that gives 2 to {MOST_SAMPLES:,}"
        )
    edges = np.arange(math.floor(periods + 1e-6) + 2) / rate_hz
    knots = np.union1d(s[s < edges[-1]], edges)
    held = u[np.searchsorted(s, knots[:-1], side="right") - 1]
    area = np.add.reduceat(held * np.diff(knots), np.searchsorted(knots, edges[:-1]))
    grid = edges[:-1]
    return t[0] + grid, area * rate_hz, np.interp(grid, s, y)


def between_measured(t: FloatArray, measured: BoolArray, grid: FloatArray) -> BoolArray:
    """Which samples of `grid` lie on a measured sample of `t`, or between two that follow each other."""
    share: BoolArray = np.interp(grid, t, measured.astype(np.float64)) > 1 - 1e-6
    return share


def describe(t: FloatArray, rate_hz: float, place: Callable[[int], str]) -> str:
    """One sentence on what resampling from stamps `t`, in s, does; `place` names the row of a stamp."""
    steps = np.diff(t)
    median = float(np.median(steps))
    if is_uniform(t):
        origin = f"{mean_rate(t):.8g} Hz"
    else:
        longest = int(steps.argmax())
        origin = (
            f"uneven stamps (median step {median:.4g} s, longest {steps[longest]:.4g} s "
            f"ending at {place(longest + 1)})"
        )
    sentence = (
        f"resampled from {origin} to {rate_hz:g} Hz: command held and averaged over each new "
        "period, output interpolated linearly"
    )
    if rate_hz * median < 1 - STEP_TOLERANCE:
        sentence += " without an anti-alias filter"
    ends = gaps(t)
    if len(ends):
        sentence += (
            f"; gaps longer than {GAP_STEPS:g} median steps: {len(ends)}, "
            f"{float(steps[ends - 1].sum()):.4g} s in all, the first ending at {place(int(ends[0]))}"
        )
    return sentence
