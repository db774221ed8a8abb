"""The likelihood of coloured encoder noise, and its sampled parameters.

The noise is the stationary autoregression of `bayes_hw.identify.noise`, given by its marginal standard
deviation sigma and its partial autocorrelations kappa_i.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import NoiseEstimate, autoregression_from_partial
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
    order = len(partial)
    polynomial = np.concatenate([np.ones((1, len(sigma))), -autoregression_from_partial(partial)], axis=0)
    quadratic = np.zeros(len(sigma))
    for j in range(order + 1):
        for i in range(j + 1):
            lag = j - i
            trimmed = sums.lagged[lag].copy()
            for s in range(i):
                trimmed -= sums.head[s] * sums.head[s + lag]
                trimmed -= sums.tail[order - j + s] * sums.tail[order - i + s]
            quadratic += (1.0 if i == j else 2.0) * polynomial[i] * polynomial[j] * trimmed
    shrinkage = 1 - partial**2
    innovation_variance = sigma**2 * np.prod(shrinkage, axis=0)
    orders = np.arange(1, order + 1)[:, None]
    log_determinant = np.sum(orders * np.log(shrinkage), axis=0)
    return (
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
