"""What a likelihood needs of residuals that stand in an array; the kernels reduce them as they simulate."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayes_hw.arrays import FloatArray
from bayes_hw.model.kernel import NONE, LaggedSums
from bayes_hw.model.robust_kernel import RobustSums


def lagged_sums(residuals: FloatArray, order: int, near: NDArray[np.int64] = NONE) -> LaggedSums:
    """Of residuals (walkers, samples), samples > order: see `bayes_hw.model.kernel.lagged_residual_sums`."""
    samples = residuals.shape[1]
    lagged = [
        np.einsum("wk,wk->w", residuals[:, lag:], residuals[:, : samples - lag]) for lag in range(order + 1)
    ]
    return LaggedSums(
        np.array(lagged),
        residuals[:, :order].T,
        residuals[:, samples - order :].T,
        residuals[:, near].T,
        residuals.sum(axis=1)[None],
    )


def robust_sums(
    residuals: FloatArray,
    autoregression: FloatArray,
    precision: FloatArray,
    near: NDArray[np.int64] = NONE,
) -> RobustSums:
    """Of residuals (walkers, samples): see `bayes_hw.model.robust_kernel.robust_residual_sums`."""
    order, samples = len(autoregression), residuals.shape[1]
    innovations = residuals[:, order:].copy()
    for lag, coefficients in enumerate(autoregression, start=1):
        innovations -= coefficients[:, None] * residuals[:, order - lag : samples - lag]
    logarithms = np.sum(np.log1p(precision[:, None] * innovations**2), axis=1)
    return RobustSums(logarithms, residuals[:, :order].T, residuals[:, near].T)
