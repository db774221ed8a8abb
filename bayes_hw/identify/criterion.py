"""The criterion by which the linear baseline is chosen, and the bound for decisive evidence.

A form of BIC (Schwarz 1978, doi 10.1214/aos/1176344136) on the residual e of the simulated output, never on
one-step predictions: N log(s^2) + p log N, with s^2 the innovation variance of an autoregression of fixed
order fitted to e (Yule and Walker). A residual is coloured by the encoder's noise, by what drifts, and by
what saturation adds up to in an integrating axis; the autoregression takes the slow part away and leaves
the band in which the poles of G differ. The whole cascade is chosen by its exact likelihood instead
(`bayes_hw.identify.growth`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import solve_toeplitz

from bayes_hw.arrays import FloatArray

AUTOREGRESSION_ORDER = 8
DECISIVE = 10.0
"""A block counts as shown by the data when leaving it out raises the criterion by more than this: the bound
for very strong evidence of Kass and Raftery 1995, doi 10.1080/01621459.1995.10476572."""


def dynamics_criterion(residuals: Sequence[FloatArray], parameters: int) -> float:
    """N log(innovation variance) + parameters log N, smaller is better; records pooled.

    Where residuals are NaN nothing was measured: those samples do not count, and of the products of each lag
    those do that there are.
    """
    samples = sum(len(e) for e in residuals)
    covariance = lagged_products(residuals, AUTOREGRESSION_ORDER) / samples
    if np.isnan(covariance).any():
        known = [np.where(np.isnan(e), 0.0, 1.0) for e in residuals]
        there = lagged_products(known, AUTOREGRESSION_ORDER)
        possible = lagged_products([np.ones_like(e) for e in residuals], AUTOREGRESSION_ORDER)
        products = lagged_products([np.nan_to_num(e) for e in residuals], AUTOREGRESSION_ORDER)
        covariance = products / np.maximum(there, 1.0) * possible / samples
        samples = int(there[0])
    covariance[0] = max(covariance[0] * (1 + 1e-10), np.finfo(float).tiny)
    coefficients = solve_toeplitz(covariance[:-1], covariance[1:])
    innovation = max(float(covariance[0] - coefficients @ covariance[1:]), np.finfo(float).tiny)
    return float(samples * np.log(innovation) + parameters * np.log(samples))


def lagged_products(residuals: Sequence[FloatArray], order: int) -> FloatArray:
    """sum over k of e(k) e(k - lag) for lags 0 to `order`, within records: shape (order + 1,)."""
    return np.array([sum(float(e[lag:] @ e[: len(e) - lag]) for e in residuals) for lag in range(order + 1)])
