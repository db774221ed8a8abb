"""The exact likelihood of repeated or quantised readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.display_kernel import held_log_likelihood, rounded_log_likelihood
from bayes_hw.gap.noise.spectra import LARGEST_NOISE_CORRELATION
from bayes_hw.gap.noise.whitener import Whitener


class DisplayLikelihood(Protocol):
    """Log-likelihood of the measured records with `count` noise parameters in unbounded coordinates."""

    @property
    def start(self) -> FloatArray: ...

    @property
    def spreads(self) -> FloatArray: ...

    def __call__(self, simulated: Sequence[FloatArray], noise: FloatArray) -> FloatArray:
        """(n,) for outputs (samples, n), one array a record, and noise coordinates (n, count)."""
        ...

    def sigma(self, noise: FloatArray) -> FloatArray:
        """The stationary noise (n,) before the display, output units."""
        ...


@dataclass(frozen=True)
class HeldLikelihood:
    """Repeated samples under first-order noise: logit of the repeats' share, log noise, its correlation."""

    measured: Sequence[FloatArray]
    start: FloatArray
    spreads: FloatArray

    @classmethod
    def near(
        cls, share: float, error: float, whitener: Whitener, measured: Sequence[FloatArray]
    ) -> HeldLikelihood:
        """Of `measured` (samples,), a record each, near the `share` of repeats, of standard `error`, and the
        noise that approximate it."""
        samples = sum(len(y) for y in measured)
        correlation = float(np.clip(whitener.correlation, 0.0, 0.95)) / LARGEST_NOISE_CORRELATION
        sigma = whitener.sigma * np.sqrt(1 - (correlation * LARGEST_NOISE_CORRELATION) ** 2)
        start = np.array([np.log(share / (1 - share)), np.log(sigma), np.arctanh(min(correlation, 0.99))])
        spreads = np.array([error / (share * (1 - share)), 1 / np.sqrt(2 * samples), 1 / np.sqrt(samples)])
        return cls(measured, start, spreads)

    def __call__(self, simulated: Sequence[FloatArray], noise: FloatArray) -> FloatArray:
        hold, sigma, correlation = self._values(noise)
        total = np.zeros(len(noise))
        for y, s in zip(self.measured, simulated, strict=True):
            held_log_likelihood(y, np.ascontiguousarray(s), hold, correlation, sigma, total)
        return total

    def sigma(self, noise: FloatArray) -> FloatArray:
        _, innovation, correlation = self._values(noise)
        return np.asarray(innovation / np.sqrt(1 - correlation**2))

    def _values(self, noise: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        correlation = LARGEST_NOISE_CORRELATION * np.tanh(noise[:, 2])
        return 1 / (1 + np.exp(-noise[:, 0])), np.exp(noise[:, 1]), np.asarray(correlation)


@dataclass(frozen=True)
class RoundedLikelihood:
    """Rounding to a lattice of known step under white noise: the logarithm of the noise.

    A probability of a lattice point over the step is comparable with the densities of other explanations.
    """

    measured: Sequence[FloatArray]
    step: float
    start: FloatArray
    spreads: FloatArray

    @classmethod
    def near(cls, step: float, sigma: float, measured: Sequence[FloatArray]) -> RoundedLikelihood:
        """Of `measured` (samples,), a record each, on a lattice of `step`, near a noise of `sigma`."""
        samples = sum(len(y) for y in measured)
        return cls(measured, step, np.array([np.log(sigma)]), np.array([3 / np.sqrt(samples)]))

    def __call__(self, simulated: Sequence[FloatArray], noise: FloatArray) -> FloatArray:
        total, sigma = np.zeros(len(noise)), self.sigma(noise)
        for y, s in zip(self.measured, simulated, strict=True):
            rounded_log_likelihood(y, np.ascontiguousarray(s), self.step, sigma, total)
            total -= len(y) * np.log(self.step)
        return total

    def sigma(self, noise: FloatArray) -> FloatArray:
        return np.exp(noise[:, 0])
