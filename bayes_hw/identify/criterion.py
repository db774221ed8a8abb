"""The two criteria by which identification chooses: one for the dynamics of G, one for the static blocks.

Both are forms of BIC (Schwarz 1978, doi 10.1214/aos/1176344136) on the residual e of the simulated output,
never on one-step predictions, and both allow for its colour.

Order, delay and integrator: N log(s^2) + p log N, with s^2 the innovation variance of an autoregression of
fixed order fitted to e (Yule and Walker). A residual is coloured by the encoder's noise, by what drifts,
and, for a linear model, by what saturation adds up to in an integrating axis; the autoregression takes the
slow part away and leaves the band in which the poles of G differ.

Saturation limits and dead zone: (N / tau) log(S / N) + p log(N / tau), with S the sum of squares of e and
tau its integrated autocorrelation time (Priestley, Spectral Analysis and Time Series, sec. 5.3.2), from the
richer model: N samples of coloured noise are worth N / tau independent ones. A limit shows in slow drift
most of all, so here the slow part must count.
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
    """N log(innovation variance) + parameters log N, smaller is better; records pooled."""
    samples = sum(len(e) for e in residuals)
    covariance = lagged_products(residuals, AUTOREGRESSION_ORDER) / samples
    covariance[0] = max(covariance[0] * (1 + 1e-10), np.finfo(float).tiny)
    coefficients = solve_toeplitz(covariance[:-1], covariance[1:])
    innovation = max(float(covariance[0] - coefficients @ covariance[1:]), np.finfo(float).tiny)
    return float(samples * np.log(innovation) + parameters * np.log(samples))


def block_criterion(residuals: Sequence[FloatArray], parameters: int, time: float) -> float:
    """(N / time) log(S / N) + parameters log(N / time), smaller is better; `time` is tau, in samples."""
    samples = sum(len(e) for e in residuals)
    variance = sum(float(e @ e) for e in residuals) / samples
    independent = samples / time
    return float(independent * np.log(max(variance, np.finfo(float).tiny)) + parameters * np.log(independent))


def autocorrelation_time(residuals: Sequence[FloatArray]) -> float:
    """tau = 1 + 2 sum of autocorrelations, in samples, at least 1; records pooled.

    The sum ends at the first lag of five times its own value (Sokal's window, as in emcee).
    """
    longest = max(len(e) for e in residuals)
    size = 1 << (2 * longest - 1).bit_length()
    covariance = np.zeros(longest)
    for e in residuals:
        spectrum = np.abs(np.fft.rfft(e, size)) ** 2
        covariance[: len(e)] += np.fft.irfft(spectrum, size)[: len(e)]
    if covariance[0] == 0:
        return 1.0
    times = 2 * np.cumsum(covariance / covariance[0]) - 1
    beyond = np.flatnonzero(np.arange(longest) >= 5 * times)
    return max(1.0, float(times[beyond[0]] if beyond.size else times[-1]))


def lagged_products(residuals: Sequence[FloatArray], order: int) -> FloatArray:
    """sum over k of e(k) e(k - lag) for lags 0 to `order`, within records: shape (order + 1,)."""
    return np.array([sum(float(e[lag:] @ e[: len(e) - lag]) for e in residuals) for lag in range(order + 1)])
