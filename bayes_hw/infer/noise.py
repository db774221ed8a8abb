"""The likelihood of coloured encoder noise, and its sampled parameters.

The noise is the stationary autoregression of `bayes_hw.identify.noise`, given by its marginal standard
deviation sigma and its partial autocorrelations kappa_i.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import special

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.identify.holes import Holes
from bayes_hw.identify.noise import NoiseEstimate, autoregression_from_partial
from bayes_hw.model.kernel import LaggedSums
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import (
    HyperbolicTangent,
    Logarithm,
    LogNormal,
    ShiftedLogarithm,
    ShiftedLogNormal,
    Uniform,
)
from bayes_hw.model.robust_kernel import RobustSums

SIGMA_LOG_SD = 1.5
DEGREES = "noise.degrees_of_freedom"
LEAST_DEGREES = 2.0
"""With two or fewer a Student-t variable has no variance, and sigma no meaning."""
EXCESS_MEDIAN, EXCESS_LOG_SD = 4.0, 1.0

UNIT_ROUNDOFF = 2.0**-53
LARGEST_ROUNDING = 10.0
"""Nats that rounding may cost a log-likelihood at most: the bound on it, which errors stay ten times below.

The quadratic form is a difference of numbers (sum_i |c_i|)^2 D_00 large. Where the coefficients of a long
autoregression have all roots near one, and the residuals are far larger than its innovations, nothing is left
of it: it may come out as zero or below, and a sampler would go there.
"""


def is_student_t(noise: Sequence[Parameter]) -> bool:
    """Whether these noise parameters are those of Student-t innovations."""
    return noise[-1].name == DEGREES


def noise_order(noise: Sequence[Parameter]) -> int:
    """The AR order p of noise parameters: sigma, p partial autocorrelations and, last, degrees of freedom."""
    return len(noise) - 1 - int(is_student_t(noise))


def log_likelihood(
    sums: LaggedSums, samples: int, sigma: FloatArray, partial: FloatArray, holes: Holes | None = None
) -> FloatArray:
    """Exact Gaussian log-likelihood of one record's residuals for every walker.

    `sigma` (walkers,) is the marginal standard deviation, `partial` (p, walkers). The quadratic form is that
    of Box, Jenkins and Reinsel, Time Series Analysis, appendix A7.4: S = sum_ij c_i c_j D_ij with
    c = (1, -phi_1, ..., -phi_p) and D_ij the lagged product sums without the i first and last terms. Minus
    infinity where rounding may have changed the result by more than LARGEST_ROUNDING. With `holes` some of
    the `samples` were not measured: `sums` are as if they were, with the residuals near the holes.
    """
    result = np.empty(len(sigma))
    lagged, head, tail = (np.ascontiguousarray(part) for part in sums[:3])
    rows = np.ascontiguousarray(sigma), np.ascontiguousarray(partial)
    _log_likelihood(lagged, head, tail, samples, *rows, result)
    if holes is not None:
        terms, logarithms = holes.corrections(sums.near, partial)
        variance = sigma**2 * np.prod(1 - partial**2, axis=0)
        result += 0.5 * holes.missing * np.log(2 * np.pi * variance) - logarithms - 0.5 * terms / variance
    return result


@compiled(nogil=True)
def _log_likelihood(lagged, head, tail, samples, sigma, partial, result):  # type: ignore[no-untyped-def]
    order, walkers = partial.shape
    phi, previous, polynomial = np.empty(order), np.empty(order), np.empty(order + 1)
    polynomial[0] = 1.0
    for k in range(walkers):
        innovation_variance = sigma[k] * sigma[k]
        log_determinant = 0.0
        for i in range(order):
            kappa = partial[i, k]
            for j in range(i):
                previous[j] = phi[j]
            for j in range(i):
                phi[j] = previous[j] - kappa * previous[i - 1 - j]
            phi[i] = kappa
            shrinkage = 1 - kappa * kappa
            innovation_variance *= shrinkage
            log_determinant += (i + 1) * np.log(shrinkage)
        for i in range(order):
            polynomial[i + 1] = -phi[i]
        quadratic, size = 0.0, np.sum(np.abs(polynomial))
        rounding = UNIT_ROUNDOFF * np.sqrt(samples) * size * size * lagged[0, k]
        if 0.5 * rounding > LARGEST_ROUNDING * innovation_variance:
            result[k] = -np.inf
            continue
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


def robust_precision(sigma: FloatArray, partial: FloatArray, degrees: FloatArray) -> FloatArray:
    """1 / (nu s^2) of every walker, with s the scale of the innovations: s^2 = sigma^2 prod(1 - kappa_i^2)
    (nu - 2) / nu, so that sigma is the marginal standard deviation."""
    return 1 / (sigma**2 * np.prod(1 - partial**2, axis=0) * (degrees - LEAST_DEGREES))


def robust_log_likelihood(
    sums: RobustSums,
    samples: int,
    sigma: FloatArray,
    partial: FloatArray,
    degrees: FloatArray,
    holes: Holes | None = None,
) -> FloatArray:
    """Log-likelihood of one record's residuals with Student-t innovations for every walker.

    e(k) given the past is its AR prediction plus s_k t with nu `degrees` (walkers,) of freedom (Lange, Little
    and Taylor, doi 10.1080/01621459.1989.10478852). For k < p prediction and scale are those of the AR(k) of
    the first k partial autocorrelations, s_k^2 = s^2 / prod_{i > k} (1 - kappa_i^2); behind `holes` (as for
    `log_likelihood`) prediction and scale are those of normal noise given what was measured.
    """
    order = len(partial)
    shrinkage = 1 - partial**2
    precision = robust_precision(sigma, partial, degrees)
    logarithms, log_scales = sums.logarithms.copy(), np.zeros(len(sigma))
    for k in range(order):
        widening = np.prod(shrinkage[k:], axis=0)
        coefficients = autoregression_from_partial(partial[:k])
        error = sums.head[k] - np.sum(coefficients * sums.head[:k][::-1], axis=0)
        logarithms += np.log1p(precision * widening * error**2)
        log_scales -= 0.5 * np.log(widening)
    if holes is not None:
        terms, change = holes.corrections(sums.near, partial, precision)
        logarithms, log_scales, samples = logarithms + terms, log_scales + change, samples - holes.missing
    constant = special.gammaln((degrees + 1) / 2) - special.gammaln(degrees / 2) - 0.5 * np.log(np.pi)
    return samples * (constant + 0.5 * np.log(precision)) - log_scales - 0.5 * (degrees + 1) * logarithms


def noise_parameters(estimate: NoiseEstimate, unit: str) -> tuple[Parameter, ...]:
    """The sampled noise parameters: marginal sigma and the partial autocorrelations.

    sigma has a log-normal prior of factor exp(2 x 1.5) = 20 about the estimate, each partial autocorrelation
    is uniform. Student-t innovations have degrees of freedom of 2 plus a log-normal of median 4 and log sd 1.
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
    if estimate.degrees_of_freedom is None:
        return (sigma, *partial)
    prior = ShiftedLogNormal(LEAST_DEGREES, EXCESS_MEDIAN, EXCESS_LOG_SD)
    transform = ShiftedLogarithm(LEAST_DEGREES)
    return (sigma, *partial, Parameter(DEGREES, "", estimate.degrees_of_freedom, prior, transform))
