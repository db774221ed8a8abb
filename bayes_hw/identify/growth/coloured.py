"""Autoregressive noise inside a descent: innovations of signals, and the likelihood that they give."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import gammaln

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.growth.sensitivity_kernel import whiten
from bayes_hw.identify.holes import Bridges, mask_of, measured_count, predictors
from bayes_hw.identify.noise import MAX_ORDER, estimate_noise


@dataclass(frozen=True, eq=False)
class Whitener:
    """Exact innovations of a stationary autoregression of order p, up to the scale of the last.

    `coefficients` (p + 1, p): row j holds the predictor from j samples. `scales` (p + 1,): the innovations'
    standard deviations over that of order p, the first larger than one. Innovations are Student t with
    `degrees_of_freedom` (Lange, Little and Taylor 1989, doi 10.2307/2290063), normal where they are infinite.
    """

    coefficients: FloatArray
    scales: FloatArray
    degrees_of_freedom: float = field(default=np.inf, kw_only=True)
    _bridges: dict[tuple[int, bytes], Bridges] = field(default_factory=dict, kw_only=True, repr=False)

    @classmethod
    def of_partial(cls, partial: FloatArray) -> Whitener:
        """From partial autocorrelations (p,)."""
        coefficients, _ = predictors(partial)
        shrinkage = np.append(1 - partial**2, 1.0)
        return cls(coefficients, 1 / np.sqrt(np.cumprod(shrinkage[::-1])[::-1]))

    @classmethod
    def of_residuals(
        cls, residuals: Sequence[FloatArray], most: int = MAX_ORDER, order: int | None = None
    ) -> Whitener:
        """Of the autoregression of order up to `most` that Burg's method and the Bayesian information
        criterion find, or of `order`."""
        partial = estimate_noise(residuals, order, most=most).partial
        return cls.of_partial(np.clip(partial, -0.99999, 0.99999))

    @property
    def order(self) -> int:
        return len(self.scales) - 1

    @property
    def has_heavy_tails(self) -> bool:
        """Whether innovations are Student t and not normal."""
        return bool(np.isfinite(self.degrees_of_freedom))

    def apply(self, rows: FloatArray, first: int = 0, measured: BoolArray | None = None) -> FloatArray:
        """Innovations of `rows` (n, samples) from sample `first` on; those before are the past.

        Samples that were not `measured` (samples,) have none, zero, and are bridged for those behind them;
        where `first` is not zero the first p samples must have been.
        """
        result, _ = self._applied(rows, first, measured)
        return result

    def _applied(self, rows: FloatArray, first: int, measured: BoolArray | None) -> tuple[FloatArray, float]:
        """Innovations, and what holes change in the sum of the logarithms of their standard deviations."""
        result = np.empty((len(rows), rows.shape[1] - first))
        whiten(rows, first, self.coefficients, self.scales, result)
        if measured is None:
            return result, 0.0
        bridges = self._bridges_of(measured, first)
        bridges.whiten(rows, measured, self.coefficients, result, first)
        return result, bridges.change

    def _bridges_of(self, measured: BoolArray, first: int) -> Bridges:
        """Kept: a descent comes here with the same holes many times."""
        key = first, measured.tobytes()
        if key not in self._bridges:
            self._bridges[key] = Bridges.of(measured, self.coefficients, self.scales**2, first)
        return self._bridges[key]

    def sum_of_squares(
        self, residuals: Sequence[FloatArray], masks: Sequence[BoolArray] | None = None
    ) -> float:
        """Of the innovations of all records, of which the samples in `masks` were measured."""
        return float(
            sum(np.sum(self.apply(e[None, :], 0, mask_of(masks, i)) ** 2) for i, e in enumerate(residuals))
        )

    def sums(self, errors: FloatArray, measured: BoolArray) -> tuple[int, float, float]:
        """Of what was `measured` of one record (samples,): its count, the sum of its squared innovations, and
        the sum of the logarithms of their standard deviations over that of order p."""
        innovations, change = self._applied(errors[None, :], 0, None if measured.all() else measured)
        logarithms = change + float(np.sum(np.log(self.scales[:-1])))
        return int(np.count_nonzero(measured)), float(np.sum(innovations**2)), logarithms

    def log_likelihood(
        self, residuals: Sequence[FloatArray], masks: Sequence[BoolArray] | None = None
    ) -> float:
        """Log-likelihood of what was measured, the innovations' scale at its maximum: exact where they are
        normal; of t, as though samples at a beginning or behind a hole were t too."""
        samples = measured_count(residuals, masks)
        squares, logarithms = [], len(residuals) * float(np.sum(np.log(self.scales[:-1])))
        for i, e in enumerate(residuals):
            innovations, change = self._applied(e[None, :], 0, mask_of(masks, i))
            squares.append(innovations[0] ** 2)
            logarithms += change
        if not self.has_heavy_tails:
            variance = max(sum(float(np.sum(a)) for a in squares) / samples, np.finfo(float).tiny)
            return -0.5 * samples * (np.log(2 * np.pi * variance) + 1) - logarithms
        measured = [mask_of(masks, i) for i in range(len(squares))]
        known = [a if mask is None else a[mask] for a, mask in zip(squares, measured, strict=True)]
        return log_likelihood_of_t(np.concatenate(known), self.degrees_of_freedom) - logarithms

    @property
    def information(self) -> float:
        """What an innovation tells of a parameter, over what one of a normal distribution of the same scale
        does (Lange, Little and Taylor 1989, appendix B)."""
        degrees = self.degrees_of_freedom
        return (degrees + 1) / (degrees + 3) if self.has_heavy_tails else 1.0

    def counted(self, innovations: FloatArray) -> FloatArray:
        """How much innovations (samples,) with heavy tails count in a step of least squares, zeros those of
        no reading."""
        squares, degrees = innovations**2, self.degrees_of_freedom
        return _weights(squares, t_variance(squares[squares > 0], degrees), degrees)


SCALE_ITERATIONS = 20
"""Of the fixed point that gives the scale of t."""


def t_variance(squares: FloatArray, degrees_of_freedom: float) -> float:
    """Square of the scale of t at its maximum, of squares (samples,) of what is distributed so."""
    if not len(squares):
        return 1.0
    variance = float(np.median(squares))
    for _ in range(SCALE_ITERATIONS):
        variance = max(variance, float(np.finfo(float).tiny))
        variance = float(np.mean(_weights(squares, variance, degrees_of_freedom) * squares))
    return max(variance, float(np.finfo(float).tiny))


def log_likelihood_of_t(squares: FloatArray, degrees_of_freedom: float) -> float:
    """Of squares (samples,) of what is distributed so, the scale at its maximum."""
    n, half = degrees_of_freedom, 0.5 * (degrees_of_freedom + 1)
    variance = t_variance(squares, n)
    one = gammaln(half) - gammaln(0.5 * n) - 0.5 * np.log(np.pi * n * variance)
    return float(len(squares) * one - half * np.sum(np.log1p(squares / (n * variance))))


def _weights(squares: FloatArray, variance: float, degrees_of_freedom: float) -> FloatArray:
    return np.asarray((degrees_of_freedom + 1) / (degrees_of_freedom + squares / variance))
