"""The lattice that rounded readings lie on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray

STEPS_OF_A_PERIOD = 3.0
"""An error over position of a shorter period, in steps of the readings, is that of the rounding itself."""


def shortest_period(measured: Sequence[FloatArray]) -> float:
    """Of an error over position that is not of the rounding itself, 0 where nothing was rounded; `measured`
    (samples,) a record, which may count its angles from any place."""
    return STEPS_OF_A_PERIOD * max(lattice_step([angles]) for angles in measured)


def lattice_step(measured: Sequence[FloatArray]) -> float:
    """The step of the lattice on which all measured values lie, 0 where there is none."""
    values = np.unique(np.concatenate(measured))
    if len(values) < 3:
        return 0.0
    gaps = np.diff(values)
    step = float(gaps[gaps > 1e-3 * np.median(gaps)].min())
    if len(values) > 0.5 * sum(len(y) for y in measured) or step <= 0:
        return 0.0
    for _ in range(3):
        index = np.round((values - values[0]) / step)
        step = float(index @ (values - values[0]) / max(index @ index, 1.0))
    off = np.abs((values - values[0]) / step - np.round((values - values[0]) / step))
    return step if off.max() < 0.05 else 0.0
