"""The likelihood of coloured encoder noise, and its sampled parameters.

The noise is the stationary autoregression of `bayes_hw.identify.noise`, given by its marginal standard
deviation sigma and its partial autocorrelations kappa_i.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import NoiseEstimate
from bayes_hw.model.kernel import LaggedSums
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import HyperbolicTangent, Logarithm, LogNormal, Uniform

SIGMA_LOG_SD = 1.5


def log_likelihood(sums: LaggedSums, samples: int, sigma: FloatArray, partial: FloatArray) -> FloatArray:
    """Exact Gaussian log-likelihood of one record's residuals for every walker.

    `sigma` (walkers,) is the marginal standard deviation, `partial` (p, walkers). The quadratic form is that
    of Box, Jenkins and Reinsel, Time Series Analysis, appendix A7.4: S = sum_ij c_i c_j D_ij with
    c = (1, -phi_1, ..., -phi_p) and D_ij the lagged product sums without the i first and last terms.
    """
    result = np.empty(len(sigma))
    lagged, head, tail = (np.ascontiguousarray(part) for part in sums)
    _log_likelihood(lagged, head, tail, samples, sigma, np.ascontiguousarray(partial), result)
    return result


@njit(cache=True, nogil=True, error_model="numpy")
def _log_likelihood(lagged, head, tail, samples, sigma, partial, result):  # type: ignore[no-untyped-def]
    order, walkers = partial.shape
    phi, previous, polynomial = np.empty(order), np.empty(order), np.empty(order + 1)
    polynomial[0] = 1.0
    for k in range(walkers):
        innovation_variance = sigma[k] * sigma[k]
        log_determinant = 0.0
        for i in range(order):
            kappa = partial[i, k]
            previous[:i] = phi[:i]
            for j in range(i):
                phi[j] = previous[j] - kappa * previous[i - 1 - j]
            phi[i] = kappa
            shrinkage = 1 - kappa * kappa
            innovation_variance *= shrinkage
            log_determinant += (i + 1) * np.log(shrinkage)
        for i in range(order):
            polynomial[i + 1] = -phi[i]
        quadratic = 0.0
        for lag in range(order + 1):
            trimmed = lagged[lag, k]
            for i in range(order + 1 - lag):
                j = i + lag
                quadratic += (1.0 if lag == 0 else 2.0) * polynomial[i] * polynomial[j] * trimmed
                if j < order:
                    trimmed -= head[i, k] * head[j, k]
                    trimmed -= tail[order - 1 - j, k] * tail[order - 1 - i, k]
        result[k] = (
            -0.5 * samples * np.log(2 * np.pi * innovation_variance)
            + 0.5 * log_determinant
            - 0.5 * quadratic / innovation_variance
        )


def noise_parameters(estimate: NoiseEstimate, unit: str) -> tuple[Parameter, ...]:
    """The sampled noise parameters: marginal sigma and the partial autocorrelations.

    sigma has a log-normal prior of factor exp(2 x 1.5) = 20 about the estimate, each partial autocorrelation
    is uniform.
    """
    sigma = Parameter(
        "noise.sigma", unit, estimate.sigma, LogNormal(estimate.sigma, SIGMA_LOG_SD), Logarithm()
    )
    partial = tuple(
        Parameter(
            f"noise.partial_autocorrelation{i}",
            "",
            float(np.clip(kappa, -0.9999, 0.9999)),
            Uniform(-1.0, 1.0),
            HyperbolicTangent(),
        )
        for i, kappa in enumerate(estimate.partial, start=1)
    )
    return (sigma, *partial)
