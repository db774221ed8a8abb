"""Autoregressive noise inside a descent: innovations of signals, and the likelihood that they give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.growth.sensitivity_kernel import whiten
from bayes_hw.identify.noise import autoregression_from_partial, estimate_noise


@dataclass(frozen=True, eq=False)
class Whitener:
    """Exact innovations of a stationary autoregression of order p, up to the scale of the last.

    `coefficients` (p + 1, p): row j holds the predictor from j samples. `scales` (p + 1,): the innovations'
    standard deviations over that of order p, the first larger than one.
    """

    coefficients: FloatArray
    scales: FloatArray

    @classmethod
    def of_partial(cls, partial: FloatArray) -> Whitener:
        """From partial autocorrelations (p,)."""
        order = len(partial)
        coefficients = np.zeros((order + 1, max(order, 1)))
        for j in range(1, order + 1):
            coefficients[j, :j] = autoregression_from_partial(partial[:j, None])[:, 0]
        shrinkage = np.append(1 - partial**2, 1.0)
        scales = 1 / np.sqrt(np.cumprod(shrinkage[::-1])[::-1])
        return cls(coefficients, scales)

    @classmethod
    def of_residuals(cls, residuals: Sequence[FloatArray], order: int | None = None) -> Whitener:
        """Of the autoregression that Burg's method and the Bayesian criterion find, or of `order`."""
        return cls.of_partial(np.clip(estimate_noise(residuals, order).partial, -0.99999, 0.99999))

    @property
    def order(self) -> int:
        return len(self.scales) - 1

    def apply(self, rows: FloatArray, first: int = 0) -> FloatArray:
        """Innovations of `rows` (n, samples) from sample `first` on; those before are the past."""
        result = np.empty((len(rows), rows.shape[1] - first))
        whiten(rows, first, self.coefficients, self.scales, result)
        return result

    def sum_of_squares(self, residuals: Sequence[FloatArray]) -> float:
        """Of the innovations of all records."""
        return float(sum(np.sum(self.apply(e[None, :]) ** 2) for e in residuals))

    def log_likelihood(self, residuals: Sequence[FloatArray]) -> float:
        """Exact Gaussian log-likelihood, the innovations' variance at its maximum."""
        samples = sum(len(e) for e in residuals)
        return self.log_likelihood_of(self.sum_of_squares(residuals), samples, len(residuals))

    def log_likelihood_of(self, sum_of_squares: float, samples: int, records: int) -> float:
        """The log-likelihood of innovations with this sum of squares."""
        variance = max(sum_of_squares / samples, np.finfo(float).tiny)
        correction = records * float(np.sum(np.log(self.scales[:-1])))
        return -0.5 * samples * (np.log(2 * np.pi * variance) + 1) - correction
