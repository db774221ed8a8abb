"""The step that an angle is read in, and the fast noise beside which it counts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray

LATTICE_TOLERANCE = 0.02
"""Largest distance of a reading from its step, in steps, mean square root."""

INVISIBLE = 0.05
"""A decimal step below this share of the noise is how the file was printed."""


def resolution(outputs: Sequence[FloatArray], sigma: float) -> float | None:
    """The step of which all readings of an output are multiples, None where there is none.

    A step of one decimal far below the noise is how the file was printed, not how the angle was read.
    """
    steps = [step for y in outputs if (step := lattice(y)) is not None]
    if len(steps) < len(outputs):
        return None
    step = min(steps)
    decimals = np.log10(step)
    printed = abs(decimals - round(decimals)) < 1e-4
    return None if printed and step < INVISIBLE * sigma else float(step)


def lattice(y: FloatArray) -> float | None:
    """The step of which all readings, shape (samples,), are whole multiples apart, to LATTICE_TOLERANCE."""
    levels = np.unique(y)
    if len(levels) < 3:
        return None
    floor = 1e-9 * max(float(np.ptp(levels)), 64 * float(np.spacing(np.abs(levels).max())) / 1e-9)
    gaps = np.diff(levels)
    gaps = gaps[gaps > floor]
    if len(gaps) == 0:
        return None
    step = float(gaps.min())
    near = gaps[gaps < 1.5 * step]
    step = float(near.mean())
    for _ in range(4):
        counts = np.round((levels - levels[0]) / step)
        weight = float(counts @ counts)
        if weight == 0:
            return None
        step = float(counts @ (levels - levels[0])) / weight
    errors = (levels - levels[0]) / step - np.round((levels - levels[0]) / step)
    if float(np.sqrt(np.mean(errors**2))) > LATTICE_TOLERANCE:
        return None
    return step
