"""Size and colour of the residual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.criterion import lagged_products

MAX_ORDER = 8


@dataclass(frozen=True, eq=False)
class Noise:
    """e(k) = sum_i autoregression[i - 1] e(k - i) + innovation(k).

    `sigma` is the marginal standard deviation of e, output units.
    """

    sigma: float
    autoregression: FloatArray


def estimate_noise(residuals: Sequence[FloatArray], parameters: int, max_order: int = MAX_ORDER) -> Noise:
    """Fit an autoregression to the residuals of all records by the Yule-Walker equations, order by BIC.

    `parameters` is the number of estimated parameters, by which the variance's degrees of freedom are
    reduced. Yule and Walker: Box, Jenkins and Reinsel, Time Series Analysis, sec. 7.3.
    """
    samples = sum(len(e) for e in residuals)
    covariance = lagged_products(residuals, max_order)
    sigma = float(np.sqrt(covariance[0] / max(samples - parameters, 1)))
    if covariance[0] == 0:
        return Noise(0.0, np.zeros(0))
    best_score, best = samples * np.log(covariance[0]), np.zeros(0)
    for order in range(1, max_order + 1):
        coefficients = solve_toeplitz(covariance[:order], covariance[1 : order + 1])
        innovation = covariance[0] - coefficients @ covariance[1 : order + 1]
        score = samples * np.log(max(innovation, 1e-300)) + order * np.log(samples)
        if score < best_score:
            best_score, best = score, np.asarray(coefficients, dtype=np.float64)
    return Noise(sigma, best)
