"""timing_jitter (held samples): the encoder repeats its last sample with a probability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.display_kernel import held_log_likelihood
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.noise_kernel import held_ages
from bayes_hw.gap.noise.random_cause import JITTER
from bayes_hw.gap.noise.spectra import LARGEST_NOISE_CORRELATION
from bayes_hw.gap.noise.stochastic_fit import StochasticFit
from bayes_hw.gap.noise.whitener import Autoregression, Whitener, fit_autoregression, no_glitches

MAX_AGE = 12


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
class HeldDisplay:
    """Repeated samples: weights of every sample's age, (samples, ages) a record; the share of repeats and
    its standard error."""

    ages: tuple[FloatArray, ...]
    share: float = 0.0
    error: float = 0.0

    def show(self, y: FloatArray, record: int) -> FloatArray:
        ages = self.ages[record]
        shown = np.zeros_like(y)
        for age in range(ages.shape[1]):
            shown += ages[:, age] * np.concatenate([np.full(age, y[0]), y[: len(y) - age]])
        return shown

    def expected(self, simulated: Sequence[FloatArray]) -> list[FloatArray]:
        weights = (1 - self.share) * self.share ** np.arange(MAX_AGE + 1)
        usual = HeldDisplay(tuple(np.tile(weights / weights.sum(), (len(y), 1)) for y in simulated))
        return [usual.show(y, record) for record, y in enumerate(simulated)]

    def likelihood(self, measured: Sequence[FloatArray], whitener: Whitener) -> HeldLikelihood:
        return HeldLikelihood.near(self.share, self.error, whitener, measured)

    def found_again(self, fit: Misfit) -> StochasticFit | None:
        return held_samples(fit)


def held_samples(fit: Misfit) -> StochasticFit | None:
    """Repeated samples: the age of every sample by a forward filter, their probability by its mean."""
    hold, coefficient = 0.3, 0.0
    sigma = 0.5 * fit.rmse
    ages: list[FloatArray] = []
    measured = fit.measured
    total = -np.inf
    for _ in range(8):
        ages, total = [], 0.0
        for y, s in zip(measured, fit.simulated, strict=True):
            weights = np.empty((len(y), MAX_AGE + 1))
            total += held_ages(y, s, hold, coefficient, sigma, weights)
            ages.append(weights)
        display = HeldDisplay(tuple(ages))
        shown = [display.show(s, record) for record, s in enumerate(fit.simulated)]
        left = [y - s for y, s in zip(measured, shown, strict=True)]
        moving = [np.abs(np.gradient(s)) > 0.5 * sigma for s in fit.simulated]
        fresh = sum(float(a[m, 0].sum()) for a, m in zip(ages, moving, strict=True))
        count = sum(int(m.sum()) for m in moving)
        if count < 50:
            return None
        hold = float(np.clip(1 - fresh / count, 0.01, 0.95))
        noise = fit_autoregression(left, no_glitches(left), 1, fit.unread)
        coefficient = float(np.clip(noise.coefficients[0], 0.0, LARGEST_NOISE_CORRELATION))
        sigma = noise.innovation_sigma
    whitener = Autoregression(
        np.array([coefficient]),
        sigma,
        sigma / float(np.sqrt(1 - coefficient**2)),
        total,
        no_glitches(fit.residuals),
        unread=fit.unread,
    )
    if hold < 0.02:
        return None
    error = float(np.sqrt(hold * (1 - hold) / count))
    return StochasticFit(
        JITTER.label,
        "held samples",
        whitener,
        total,
        {"timing_jitter.repeated_share": (hold, error, "")},
        HeldDisplay(tuple(ages), hold, error),
    )
