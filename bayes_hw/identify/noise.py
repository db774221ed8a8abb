"""Coloured noise estimated from residuals: a stationary autoregression.

    e(k) = phi_1 e(k-1) + ... + phi_p e(k-p) + a(k),    a(k) ~ N(0, sigma_a^2)

It is given by its marginal standard deviation sigma and its p partial autocorrelations kappa_i in (-1, 1):
every such vector is stationary, and sigma_a^2 = sigma^2 prod(1 - kappa_i^2)
(Barndorff-Nielsen and Schou, doi 10.1016/0047-259X(73)90030-4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray

MAX_ORDER = 12


@dataclass(frozen=True, eq=False)
class NoiseEstimate:
    """A point estimate of the noise: marginal `sigma` (output units) and partial autocorrelations (p,).

    The a(k) are Student t with `degrees_of_freedom` where that is a number, normal where it is None.
    """

    sigma: float
    partial: FloatArray
    degrees_of_freedom: float | None = None

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


def whitened(values: FloatArray, weights: FloatArray) -> FloatArray:
    """What an autoregression with `weights` leaves of values along the first axis, the first ones, as many as
    its order, left out."""
    order = len(weights)
    left: FloatArray = values[order:].copy()
    part = np.empty_like(left)
    for lag, weight in enumerate(weights, start=1):
        left -= np.multiply(values[order - lag : len(values) - lag], weight, out=part)
    return left


def estimate_noise(
    residuals: Sequence[FloatArray], order: int | None = None, *, most: int = MAX_ORDER
) -> NoiseEstimate:
    """Burg's estimate over all segments; the order minimises the Bayesian information criterion.

    `residuals` are the residual sequences of the records, NaN where nothing was measured. A given `order` is
    taken as it is; otherwise none beyond `most` is.
    """
    largest = most if order is None else order
    partial, variances = burg(residuals, largest)
    samples = sum(len(segment) for segment in residuals)
    price = np.log(samples) * np.arange(largest + 1)
    if not _holes(residuals):
        criterion = samples * np.log(np.maximum(variances, np.finfo(float).tiny)) + price
    else:
        samples = sum(int(np.count_nonzero(~np.isnan(segment))) for segment in residuals)
        pairs = _complete_pairs(residuals, largest)
        gained = np.cumsum(pairs * np.log1p(-np.minimum(partial**2, 1 - 1e-15)))
        criterion = samples * np.log(variances[0]) + np.append(0.0, gained) + price
    chosen = int(np.argmin(criterion)) if order is None else order
    kept = partial[:chosen]
    sigma = float(np.sqrt(variances[chosen] / np.prod(1 - kept**2)))
    return NoiseEstimate(sigma, kept)


def _holes(segments: Sequence[FloatArray]) -> bool:
    return any(bool(np.isnan(segment).any()) for segment in segments)


def _complete_pairs(segments: Sequence[FloatArray], order: int) -> FloatArray:
    """For every lag from 1 to `order`, how many stretches of so many samples and one were measured whole."""
    found = np.zeros(order)
    for segment in segments:
        known = run = ~np.isnan(segment)
        for lag in range(1, order + 1):
            run = run[1:] & known[: len(known) - lag]
            found[lag - 1] += np.count_nonzero(run)
    return found


def burg(segments: Sequence[FloatArray], order: int) -> tuple[FloatArray, FloatArray]:
    """Partial autocorrelations (order,) and innovation variances (order + 1,) pooled over the segments.

    Burg's recursion: kappa_i maximises the reduction of forward and backward prediction errors together.
    Where samples are NaN, those errors count that need none of them.
    """
    holes = _holes(segments)
    forward = [np.asarray(segment, dtype=np.float64) for segment in segments]
    backward = [segment.copy() for segment in forward]
    samples = sum(len(segment) for segment in forward)
    if holes:
        samples = sum(int(np.count_nonzero(~np.isnan(segment))) for segment in forward)
    variances = np.empty(order + 1)
    variances[0] = sum(_product(segment, segment, holes) for segment in forward) / samples
    partial = np.zeros(order)
    for i in range(order):
        ahead = [f[1:] for f in forward]
        behind = [b[:-1] for b in backward]
        product = 2 * sum(_product(f, b, holes) for f, b in zip(ahead, behind, strict=True))
        power = sum(_power(f, b, holes) for f, b in zip(ahead, behind, strict=True))
        kappa = product / power if power > 0 else 0.0
        forward = [f - kappa * b for f, b in zip(ahead, behind, strict=True)]
        backward = [b - kappa * f for f, b in zip(ahead, behind, strict=True)]
        partial[i] = kappa
        variances[i + 1] = variances[i] * (1 - kappa**2)
    return partial, variances


def _product(f: FloatArray, b: FloatArray, holes: bool) -> float:
    return float(np.nansum(f * b)) if holes else float(f @ b)


def _power(f: FloatArray, b: FloatArray, holes: bool) -> float:
    return float(np.nansum(f * f + b * b)) if holes else float(f @ f + b @ b)


def stationary_autoregression(
    samples: int,
    sigma: float,
    partial: FloatArray,
    rng: np.random.Generator,
    degrees_of_freedom: float | None = None,
) -> FloatArray:
    """An AR(p) sequence (samples,) of marginal standard deviation `sigma`, from its first sample on.

    Its innovations are normal, or Student t of more than two `degrees_of_freedom`.

    The first p samples follow from the partial autocorrelations order by order: sample k is predicted by the
    AR(k) of the first k of them.
    """
    order = len(partial)
    if degrees_of_freedom is None:
        shocks = rng.standard_normal(samples)
    else:
        unit = np.sqrt((degrees_of_freedom - 2) / degrees_of_freedom)
        shocks = unit * rng.standard_t(degrees_of_freedom, samples)
    noise = np.zeros(samples)
    spread = sigma * np.sqrt(np.concatenate([[1.0], np.cumprod(1 - partial**2)]))
    for k in range(min(order, samples)):
        coefficients = autoregression_from_partial(partial[:k, None])[:, 0]
        noise[k] = coefficients @ noise[:k][::-1] + spread[k] * shocks[k]
    polynomial = np.concatenate([[1.0], -autoregression_from_partial(partial[:, None])[:, 0]])
    if samples > order:
        from scipy import signal  # takes a second to import, which who only estimates noise need not wait

        history = signal.lfiltic([1.0], polynomial, noise[:order][::-1])
        noise[order:] = signal.lfilter([1.0], polynomial, spread[order] * shocks[order:], zi=history)[0]
    return noise


def samples_worth_one(residuals: Sequence[FloatArray]) -> float:
    """1 + 2 sum of squared autocorrelations up to the first that is not positive: by so many samples are
    products of two series of the residuals' colour correlated (Bayley and Hammersley 1946, doi
    10.2307/2983560)."""
    filled = [np.nan_to_num(e) for e in residuals]
    power = sum(float(e @ e) for e in filled)
    total = 1.0
    for lag in range(1, max(len(e) for e in filled)):
        correlation = sum(float(e[lag:] @ e[:-lag]) for e in filled if len(e) > lag) / power
        if correlation <= 0:
            break
        total += 2 * correlation**2
    return total
