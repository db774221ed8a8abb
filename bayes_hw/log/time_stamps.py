"""What the time stamps of a record say: their resolution, their rate, and where they are uneven."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray

STEP_TOLERANCE = 0.01
"""Largest relative difference of a step from the median step in stamps taken as uniform."""

COARSEST_RESOLUTION = 0.8
"""Coarsest resolution, in steps, at which stamps still tell a missing sample from rounding."""

GAP_STEPS = 3.0
"""A step longer than this many median steps is a gap."""

MOST_DECIMALS = 9


def resolution(t: FloatArray) -> float:
    """Step of the decimal grid on which all stamps lie, in s; the spacing of floats if there is none."""
    spacing = 2 * float(np.spacing(np.abs(t).max()))
    for decimals in range(MOST_DECIMALS + 1):
        if np.abs(np.round(t, decimals) - t).max() <= spacing:
            return max(10.0**-decimals, spacing)
    return spacing


def first_not_increasing(t: FloatArray) -> int | None:
    """Index of the first stamp that does not lie after the one before it, or None."""
    faults = np.flatnonzero(np.diff(t) <= 0)
    return int(faults[0]) + 1 if len(faults) else None


def runs_backwards(t: FloatArray) -> bool:
    """Whether the newest stamp of (samples,) stands first."""
    return len(t) > 2 and t[-1] < t[0] and bool((np.diff(t) <= 0).all())


def rate_of_cut_stamps(t: FloatArray) -> float | None:
    """Rate in Hz of stamps (samples,), in s, that are cut to whole seconds and so repeat; None of others."""
    if len(t) < 3 or (np.diff(t) < 0).any() or t[-1] - t[0] < 2:
        return None
    distinct, counts = np.unique(t, return_counts=True)
    usual = float(np.median(counts[1:-1])) if len(counts) > 2 else 1.0
    is_whole = resolution(distinct) >= 1 or float(np.median(np.diff(distinct))) >= 1
    return usual if usual > 1.5 and is_whole else None


def gaps(t: FloatArray) -> IntArray:
    """Index of each stamp that ends a step longer than `GAP_STEPS` median steps."""
    steps = np.diff(t)
    return np.flatnonzero(steps > GAP_STEPS * np.median(steps)) + 1


def is_uniform(t: FloatArray) -> bool:
    """Whether increasing stamps, shape (samples,), in s, are those of a uniform rate.

    True when every step is within 1 % of the median step, or when rounding (or cutting) equidistant
    times to the decimals of the stamps explains the differences, which a resolution coarser than
    `COARSEST_RESOLUTION` cannot.
    """
    steps = np.diff(t)
    median = float(np.median(steps))
    if np.abs(steps - median).max() <= STEP_TOLERANCE * median:
        return True
    rounding = resolution(t)
    if rounding > COARSEST_RESOLUTION * float(t[-1] - t[0]) / len(steps):
        return False
    return _strip_width(t) <= 1.01 * rounding + 4 * float(np.spacing(np.abs(t).max()))


def first_step_change(t: FloatArray) -> int:
    """Index of the stamp that ends the first step differing from the step before it.

    Differences within the tolerance or within rounding do not count; if no other is left, the stamp
    that ends the step farthest from the median. Needs three stamps.
    """
    steps = np.diff(t)
    median = float(np.median(steps))
    rounding = resolution(t)
    tolerance = STEP_TOLERANCE * median + (2 * rounding if 2 * rounding < median else 0)
    changes = np.flatnonzero(np.abs(np.diff(steps)) > tolerance)
    if len(changes):
        return int(changes[0]) + 2
    return max(int(np.abs(steps - median).argmax()) + 1, 2)


def mean_rate(t: FloatArray) -> float:
    """Sample rate of uniform stamps, in Hz: (samples - 1) / (last - first), simplified.

    The rate or its period is rounded to the fewest digits that the stamps, which are known to their
    resolution and their scatter about a line, cannot tell from the mean.
    """
    span = float(t[-1] - t[0])
    rate = (len(t) - 1) / span
    uncertainty = max(resolution(t), float(np.ptp(_line_residuals(t)[0]))) / span
    return fewest_digits(rate, uncertainty)


def fewest_digits(rate: float, uncertainty: float) -> float:
    """`rate`, in Hz, or its period rounded to the fewest digits that change it by no more than `uncertainty`,
    relative to it."""
    for digits in range(15):
        for candidate in (float(f"{rate:.{digits}e}"), 1 / float(f"{1 / rate:.{digits}e}")):
            if abs(candidate / rate - 1) <= uncertainty:
                return candidate
    return rate


def _line_residuals(t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Deviations of the stamps from their least-squares line, in s, and the centred sample numbers."""
    k: FloatArray = np.arange(len(t), dtype=np.float64) - (len(t) - 1) / 2
    s: FloatArray = t - t[0]
    return s - float(k @ s) / float(k @ k) * k, k


def _strip_width(t: FloatArray) -> float:
    """Extent in time, in s, of the narrowest strip about a straight line that holds all stamps."""
    from scipy.optimize import minimize_scalar

    residuals, k = _line_residuals(t)
    steepest = 2 * float(np.ptp(residuals)) / len(t)
    narrowest = minimize_scalar(
        lambda slope: float(np.ptp(residuals - slope * k)),
        bounds=(-steepest, steepest),
        method="bounded",
        options={"xatol": 1e-3 * steepest},
    )
    return float(narrowest.fun)
