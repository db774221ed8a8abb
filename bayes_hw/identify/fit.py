"""The fit percentage by which the paper compares models."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray


def fit_percent(measured: FloatArray, simulated: FloatArray) -> float:
    """100 (1 - ||y - y_simulated|| / ||y - mean y||), eq. 14 of the paper; both of shape (samples,).

    100 is a perfect fit, 0 no better than the mean of y, negative worse than it. A constant `measured` has no
    fit: ValueError. Samples where either is NaN do not count.
    """
    known = ~np.isnan(measured - simulated)
    if not known.all():
        measured, simulated = measured[known], simulated[known]
    spread = float(np.linalg.norm(measured - measured.mean()))
    if spread == 0:
        raise ValueError("fit_percent: the measured output is constant")
    return float(100 * (1 - np.linalg.norm(measured - simulated) / spread))
