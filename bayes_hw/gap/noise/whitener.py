"""What turns residuals into white ones of unit variance, one class a kind of noise.

A whitener is linear in the residual, so the same operator serves the residual and the derivatives of the
simulated output; `log_likelihood` is that of the residuals it was fitted to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.noise.noise_kernel import bridged_over, innovations
from bayes_hw.gap.simulate.columns import blank, count_true, scaled, square_sums
from bayes_hw.identify.holes import whitened_over_holes
from bayes_hw.identify.noise import estimate_noise

if TYPE_CHECKING:
    from bayes_hw.gap.noise.state_noise import StateNoise

LOG_2PI = float(np.log(2 * np.pi))


class Whitener(Protocol):
    """Columns in, whitened columns out, a record at a time."""

    def whiten(self, columns: FloatArray, record: int) -> FloatArray:
        """`columns` (samples, n) of one record, white and of unit variance."""
        ...

    @property
    def log_likelihood(self) -> float:
        """Of the residuals that the whitener was fitted to."""
        ...

    @property
    def parameter_count(self) -> int:
        """Free parameters of the noise."""
        ...

    @property
    def sigma(self) -> float:
        """Marginal standard deviation of the stationary noise, output units."""
        ...

    @property
    def correlation(self) -> float:
        """Of neighbouring samples of the encoder's own noise, where that is of first order; else 0."""
        ...

    @property
    def has_density(self) -> bool:
        """Whether the noise has a density of single samples."""
        ...

    def evened(self, residuals: Sequence[FloatArray]) -> list[FloatArray]:
        """Residuals (samples,), a record each, with the spread of a sample at rest everywhere."""
        ...

    def hidden(self, residuals: Sequence[FloatArray]) -> list[BoolArray]:
        """Where the dead zone hides a disturbance (samples,), a record each: going there residuals jump."""
        ...

    def glitches_in(self, residuals: Sequence[FloatArray]) -> Sequence[BoolArray]:
        """A mask (samples,) a record of glitches, which are no noise."""
        ...

    def power(self, turns_a_sample: FloatArray) -> FloatArray:
        """Power a sample of the encoder's own noise (frequencies,), output units squared."""
        ...

    @property
    def with_states(self) -> StateNoise | None:
        """Itself, if it is a disturbance with states beside the encoder's own noise."""
        ...


class Homogeneous:
    """The answers of noise that is the same in every sample, and white as far as it is the encoder's own."""

    has_density = True

    glitches: Sequence[BoolArray] | None = None

    def evened(self, residuals: Sequence[FloatArray]) -> list[FloatArray]:
        return list(residuals)

    def hidden(self, residuals: Sequence[FloatArray]) -> list[BoolArray]:
        return no_glitches(residuals)

    def glitches_in(self, residuals: Sequence[FloatArray]) -> Sequence[BoolArray]:
        return no_glitches(residuals) if self.glitches is None else self.glitches

    def power(self: Whitener, turns_a_sample: FloatArray) -> FloatArray:
        return np.full(len(turns_a_sample), self.sigma**2)

    @property
    def with_states(self) -> StateNoise | None:
        return None


@dataclass(frozen=True)
class Plain(Homogeneous):
    """White noise of a given sigma: the plain residuals that a first fit starts on.

    Samples in `masked` (a mask a record, or no mask at all) do not count.
    """

    sigma: float
    log_likelihood: float = float("nan")
    parameter_count: int = 1
    masked: tuple[BoolArray, ...] = ()
    correlation: float = 0.0

    def widened(self, sigma: float) -> Plain:
        """The same with `sigma` where that is larger."""
        return replace(self, sigma=max(sigma, self.sigma))

    def without(self, masks: Sequence[BoolArray]) -> Plain:
        """The same with the samples in `masks`, a mask a record, not counted either."""
        own = self.masked or tuple(np.zeros_like(mask) for mask in masks)
        return replace(self, masked=tuple(one | other for one, other in zip(own, masks, strict=True)))

    def whiten(self, columns: FloatArray, record: int) -> FloatArray:
        white: FloatArray = scaled(columns, 1 / self.sigma)
        if self.masked:
            blank(white, self.masked[record])
        return white


@dataclass(frozen=True)
class Autoregression(Homogeneous):
    """Stationary autoregressive noise; samples in `glitches` (a mask a record) are bridged, and conditioned
    across where they are `unread`: exactly, see `bayes_hw.identify.holes`."""

    coefficients: FloatArray
    innovation_sigma: float
    sigma: float
    log_likelihood: float
    glitches: Sequence[BoolArray]
    parameter_count: int = 2
    unread: Sequence[BoolArray] | None = None

    @property
    def correlation(self) -> float:
        return float(self.coefficients[0]) if len(self.coefficients) == 1 else 0.0

    def whiten(self, columns: FloatArray, record: int) -> FloatArray:
        return self.whitened(columns, record)[0]

    def whitened(self, columns: FloatArray, record: int) -> tuple[FloatArray, float]:
        """`columns` white, and what unread samples change in the sum of the logarithms of the innovations'
        standard deviations."""
        glitches, change = self.glitches[record], 0.0
        unread = None if self.unread is None else self.unread[record]
        bridged = bridge(columns, glitches if unread is None else glitches | unread)
        white: FloatArray = innovations(bridged, self.coefficients, self.innovation_sigma, self.sigma)
        if unread is not None and count_true(unread):
            rows = np.ascontiguousarray(white.T)
            change = whitened_over_holes(np.ascontiguousarray(bridged.T), ~unread, *self._predictors(), rows)
            white = np.ascontiguousarray(rows.T)
        blank(white, glitches)
        return white, change

    def power(self, turns_a_sample: FloatArray) -> FloatArray:
        lags = np.arange(1, len(self.coefficients) + 1)
        turns = np.exp(-2j * np.pi * np.outer(turns_a_sample, lags))
        return np.asarray(self.innovation_sigma**2 / np.abs(1 - turns @ self.coefficients) ** 2)

    def _predictors(self) -> tuple[FloatArray, FloatArray]:
        """Of every number of samples known; fewer than the order are of no use (see `innovations`)."""
        order = len(self.coefficients)
        coefficients = np.zeros((order + 1, max(order, 1)))
        coefficients[order, :order] = self.coefficients
        variances = np.full(order + 1, self.sigma**2)
        variances[order] = self.innovation_sigma**2
        return coefficients, variances


def no_glitches(residuals: Sequence[FloatArray]) -> list[BoolArray]:
    """A mask (samples,) a record with nothing in it."""
    return [np.zeros(len(e), dtype=np.bool_) for e in residuals]


def bridge(columns: FloatArray, gaps: BoolArray) -> FloatArray:
    """`columns` (samples, n) with the samples in `gaps` interpolated from their neighbours."""
    return np.asarray(bridged_over(columns, gaps)) if count_true(gaps) else columns


def bridged_records(records: Sequence[FloatArray], gaps: Sequence[BoolArray]) -> list[FloatArray]:
    """Every record (samples,) with the samples in its gaps interpolated."""
    return [bridge(e[:, None], mask)[:, 0] for e, mask in zip(records, gaps, strict=True)]


def readings_of(residuals: Sequence[FloatArray], unread: Sequence[BoolArray] | None) -> int:
    """Samples of all records that were measured."""
    missing = 0 if unread is None else sum(count_true(mask) for mask in unread)
    return sum(len(e) for e in residuals) - missing


def only_read(records: Sequence[FloatArray], unread: Sequence[BoolArray] | None) -> list[FloatArray]:
    """Every record (samples,) without the samples that were not measured."""
    if unread is None:
        return list(records)
    return [e[~mask] for e, mask in zip(records, unread, strict=True)]


def fit_autoregression(
    residuals: Sequence[FloatArray],
    glitches: Sequence[BoolArray],
    order: int,
    unread: Sequence[BoolArray] | None = None,
) -> Autoregression:
    """Autoregressive noise of `order` fitted to residuals (samples,), glitches bridged and not counted, nor
    what is `unread`."""
    bridged = bridged_records(residuals, glitches)
    if unread is not None:
        bridged = [np.where(mask, np.nan, e) for e, mask in zip(bridged, unread, strict=True)]
    estimate = estimate_noise(bridged, order)
    model = Autoregression(
        estimate.autoregression, estimate.innovation_sigma, estimate.sigma, 0.0, glitches, order + 1, unread
    )
    total = 0.0
    for record, e in enumerate(residuals):
        white, change = model.whitened(e[:, None], record)
        squares = square_sums(white)[0]
        readings = len(e) - count_true(glitches[record])
        total -= 0.5 * float(squares) + readings * (np.log(model.innovation_sigma) + 0.5 * LOG_2PI)
        if unread is not None:
            total -= change - 0.5 * LOG_2PI * count_true(unread[record])
    return replace(model, log_likelihood=total)
