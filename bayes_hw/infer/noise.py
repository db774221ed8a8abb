"""Coloured encoder noise: a stationary Gaussian AR(p) process with its exact likelihood.

    e(k) = phi_1 e(k-1) + ... + phi_p e(k-p) + a(k),    a(k) ~ N(0, sigma_a^2)

It is parametrised by its marginal standard deviation sigma and its p partial autocorrelations kappa_i in
(-1, 1): every such vector is stationary, and sigma_a^2 = sigma^2 prod(1 - kappa_i^2)
(Barndorff-Nielsen and Schou, doi 10.1016/0047-259X(73)90030-4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.model.kernel import LaggedSums
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import HyperbolicTangent, Logarithm, LogNormal, Uniform

SIGMA_LOG_SD = 1.5
MAX_ORDER = 12


@dataclass(frozen=True, eq=False)
class NoiseEstimate:
    """A point estimate of the noise: marginal `sigma` (output units) and partial autocorrelations (p,).

    `criterion` holds the Bayesian information criterion of every order tried, from zero.
    """

    sigma: float
    partial: FloatArray
    criterion: FloatArray

    @property
    def order(self) -> int:
        return len(self.partial)

    @property
    def autoregression(self) -> FloatArray:
        """phi_1 ... phi_p."""
        return autoregression_from_partial(self.partial[:, None])[:, 0]

    @property
    def innovation_sigma(self) -> float:
        """Standard deviation of a(k), output units."""
        return self.sigma * float(np.sqrt(np.prod(1 - self.partial**2)))


def autoregression_from_partial(partial: FloatArray) -> FloatArray:
    """phi (p, walkers) of partial autocorrelations (p, walkers), by the Durbin-Levinson recursion."""
    coefficients = np.zeros_like(partial)
    for i, kappa in enumerate(partial):
        previous = coefficients[:i].copy()
        coefficients[:i] = previous - kappa * previous[::-1]
        coefficients[i] = kappa
    return coefficients


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


def estimate_noise(residuals: Sequence[FloatArray], order: int | None = None) -> NoiseEstimate:
    """Burg's estimate over all segments; the order minimises the Bayesian information criterion.

    `residuals` are the residual sequences of the records. A given `order` is taken as it is.
    """
    largest = MAX_ORDER if order is None else order
    partial, variances = burg(residuals, largest)
    samples = sum(len(segment) for segment in residuals)
    criterion = samples * np.log(variances) + np.log(samples) * np.arange(largest + 1)
    chosen = int(np.argmin(criterion)) if order is None else order
    kept = partial[:chosen]
    sigma = float(np.sqrt(variances[chosen] / np.prod(1 - kept**2)))
    return NoiseEstimate(sigma, kept, criterion)


def burg(segments: Sequence[FloatArray], order: int) -> tuple[FloatArray, FloatArray]:
    """Partial autocorrelations (order,) and innovation variances (order + 1,) pooled over the segments.

    Burg's recursion: kappa_i maximises the reduction of forward and backward prediction errors together.
    """
    forward = [np.asarray(segment, dtype=np.float64) for segment in segments]
    backward = [segment.copy() for segment in forward]
    samples = sum(len(segment) for segment in forward)
    variances = np.empty(order + 1)
    variances[0] = sum(float(segment @ segment) for segment in forward) / samples
    partial = np.zeros(order)
    for i in range(order):
        ahead = [f[1:] for f in forward]
        behind = [b[:-1] for b in backward]
        product = 2 * sum(float(f @ b) for f, b in zip(ahead, behind, strict=True))
        power = sum(float(f @ f + b @ b) for f, b in zip(ahead, behind, strict=True))
        kappa = product / power if power > 0 else 0.0
        forward = [f - kappa * b for f, b in zip(ahead, behind, strict=True)]
        backward = [b - kappa * f for f, b in zip(ahead, behind, strict=True)]
        partial[i] = kappa
        variances[i + 1] = variances[i] * (1 - kappa**2)
    return partial, variances


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
