"""Whether what moves the readings comes in jumps."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.identify.growth.descent import innovations

WINDOWS = (1, 6)
"""Samples whose innovations are summed: a jump that the axis follows goes on for several."""

NORMAL = 0.6
"""Largest excess kurtosis of such sums where nothing jumps."""

CLEAR = 3.0
"""Standard deviations of the innovations by which a sample lies beyond the dead zone."""

FEWEST = 400
"""Samples that tell a kurtosis."""


def jumps(fit: JointFit) -> bool:
    """Whether innovations of a fit, or their sums over WINDOWS, are far from normal.

    Where the dead zone holds the output they come in jumps whatever moves the axis: such samples, by what is
    simulated or by what was measured, do not count.
    """
    return max(sum_kurtosis(fit, window) for window in WINDOWS) > NORMAL


def sum_kurtosis(fit: JointFit, window: int) -> float:
    """Excess kurtosis of sums of so many innovations clear of the dead zone, without the largest of them and
    what overlaps it: what happens once is no way to move. Zero where these are few."""
    values, margin = fit.values, CLEAR * fit.innovation_sigma
    reach = values.cascade.half_width + margin
    found: list[FloatArray] = []
    response = fit.response
    for white, record, told in zip(innovations(fit.point), response.records, response.told, strict=True):
        w = np.abs(response.simulate(values, record.u, record.known).w)
        beyond = ((w > reach) & (np.abs(record.y) > margin))[told]
        if len(white) < window:
            continue
        ones = np.ones(window)
        clear = np.convolve(beyond, ones, "valid") > window - 0.5
        found.append(np.convolve(white, ones, "valid")[clear])
    a = np.concatenate([np.zeros(0), *found])
    if len(a) >= FEWEST:
        once = int(np.argmax(np.abs(a)))
        a = np.delete(a, slice(max(once - window + 1, 0), once + window))
    return float(np.mean(a**4) / np.mean(a**2) ** 2 - 3) if len(a) >= FEWEST else 0.0
