"""Stochastic effects: what the residuals of a fit say of each, with the whitener that belongs to it.

They change the noise, not the response: no simulator can track their realisation, so what they improve is
the predictive density and the band. Wind and a random walk of the encoder are in `slow_noise`, samples off
their instants in `clock_jitter`.

- timing_jitter (held samples): the encoder repeats its last sample with a probability
- outliers: isolated glitches, a mixture with a wide component
- encoder_quantization: y lies on a lattice whose step is well above the noise (interval likelihood)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.special import log_ndtr

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.display_likelihood import DisplayLikelihood, HeldLikelihood, RoundedLikelihood
from bayes_hw.gap.noise.glitches import Glitches
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.noise_kernel import held_ages
from bayes_hw.gap.noise.random_cause import RANDOM_CAUSES, ROUNDING, RandomCause
from bayes_hw.gap.noise.spectra import LARGEST_NOISE_CORRELATION
from bayes_hw.gap.noise.whitener import (
    Autoregression,
    Plain,
    Whitener,
    fit_autoregression,
    no_glitches,
    only_read,
)

MAX_AGE = 12
NOISE_ORDER = 1
SMALLEST_STEP = 1.8
"""Of the noise: a coarser lattice of y is quantization, a finer one is not told from noise."""


class Display(Protocol):
    """How an encoder shows an output."""

    def show(self, y: FloatArray, record: int) -> FloatArray:
        """The expected display of `y` (samples,) of a training record."""
        ...

    def expected(self, simulated: Sequence[FloatArray]) -> list[FloatArray]:
        """The expected display of outputs (samples,) of records that nobody has read."""
        ...

    def likelihood(self, measured: Sequence[FloatArray], whitener: Whitener) -> DisplayLikelihood:
        """The exact likelihood of the training records, which the display and `whitener` approximate."""
        ...

    def found_again(self, fit: Misfit) -> StochasticFit | None:
        """The cause with the display that another simulation of the same records gives it."""
        ...


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


@dataclass(frozen=True)
class RoundedDisplay:
    """Rounding of y + noise to a lattice: its mean, a staircase with steps as soft as the noise."""

    step: float
    offset: float
    sigma: float

    def show(self, y: FloatArray, record: int) -> FloatArray:  # noqa: ARG002
        place = (y - self.offset) / self.step
        below = np.floor(place)
        part = place - below
        width = max(self.sigma / self.step, 0.02)
        up = np.exp(log_ndtr((part - 0.5) / width)) + np.exp(log_ndtr((part - 1.5) / width))
        down = np.exp(log_ndtr(-(part + 0.5) / width))
        return np.asarray(self.offset + self.step * (below + up - down))

    def expected(self, simulated: Sequence[FloatArray]) -> list[FloatArray]:
        """As simulated: rounding is off as often up as down."""
        return list(simulated)

    def likelihood(self, measured: Sequence[FloatArray], whitener: Whitener) -> RoundedLikelihood:  # noqa: ARG002
        return RoundedLikelihood.near(self.step, self.sigma, measured)

    def found_again(self, fit: Misfit) -> StochasticFit | None:
        return quantization(fit, np.inf)


@dataclass(frozen=True)
class StochasticFit:
    """A stochastic effect fitted to residuals: label, form, whitener, log-likelihood, named parameters.

    `display` is how the encoder shows the simulated output, where the effect changes that;
    `encoder_sigma` the encoder's own noise where the whitener holds more than that, `size` the error that
    the effect makes, where it has one (output units); `point` its parameters as they are searched, where a
    search can start from them; `beside` the label of a second stochastic effect that the noise holds.
    """

    label: str
    form: str
    whitener: Whitener
    log_likelihood: float
    parameters: dict[str, tuple[float, float, str]]
    display: Display | None = None
    encoder_sigma: float | None = None
    size: float | None = None
    point: FloatArray | None = None
    beside: str | None = None

    @property
    def labels(self) -> tuple[str, ...]:
        """Of all random causes in the noise."""
        return (self.label,) if self.beside is None else (self.label, self.beside)

    @property
    def cause(self) -> RandomCause:
        """The first cause, or the only one."""
        return RANDOM_CAUSES[self.label]

    @property
    def drifts(self) -> bool:
        """Whether the noise is slow, so that it may hold motion that a response would have to follow."""
        return self.size is not None

    @property
    def isolates(self) -> bool:
        """Whether a cause spoils some samples and leaves those beside them."""
        return any(RANDOM_CAUSES[label].isolated for label in self.labels)

    @property
    def second(self) -> StochasticFit | None:
        """The effect beside the first as if it were the only one, None where there is none."""
        if self.beside is None:
            return None
        own = {name: value for name, value in self.parameters.items() if name.startswith(f"{self.beside}.")}
        return replace(self, label=self.beside, form="", parameters=own, size=None, point=None, beside=None)

    def with_second(
        self, label: str, form: str, parameters: dict[str, tuple[float, float, str]]
    ) -> StochasticFit:
        """The same noise with a second effect in it, of `label`; `form` says so."""
        forms = ", ".join(filter(None, [self.form, form]))
        return replace(self, form=forms, parameters={**self.parameters, **parameters}, beside=label)


def autoregression(fit: Misfit, order: int = NOISE_ORDER) -> Autoregression:
    """Autoregressive noise of the fit's residuals, no glitches masked."""
    return fit_autoregression(fit.residuals, no_glitches(fit.residuals), order, fit.unread)


def outliers(fit: Misfit) -> StochasticFit | None:
    """Glitches in the residuals of `fit`: the likelihood of the mixture of both kinds of sample."""
    glitches = Glitches.of(fit.residuals)
    if glitches is None:
        return None
    noise = fit_autoregression(fit.residuals, glitches.masks, NOISE_ORDER, fit.unread)
    total = noise.log_likelihood + glitches.log_likelihood
    whitener = replace(noise, log_likelihood=total, parameter_count=Autoregression.parameter_count)
    return StochasticFit("outliers", "", whitener, total, glitches.parameters(fit.scale.units.output))


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
        "timing_jitter",
        "held samples",
        whitener,
        total,
        {"timing_jitter.repeated_share": (hold, error, "")},
        HeldDisplay(tuple(ages), hold, error),
    )


def lattice_step(measured: Sequence[FloatArray]) -> float:
    """The step of the lattice on which all measured values lie, 0 where there is none."""
    values = np.unique(np.concatenate(measured))
    if len(values) < 3:
        return 0.0
    gaps = np.diff(values)
    step = float(gaps[gaps > 1e-3 * np.median(gaps)].min())
    if len(values) > 0.5 * sum(len(y) for y in measured) or step <= 0:
        return 0.0
    for _ in range(3):
        index = np.round((values - values[0]) / step)
        step = float(index @ (values - values[0]) / max(index @ index, 1.0))
    off = np.abs((values - values[0]) / step - np.round((values - values[0]) / step))
    return step if off.max() < 0.05 else 0.0


def rounding_step(step: float, unit: str) -> dict[str, tuple[float, float, str]]:
    """The parameter of a rounding encoder, known to a millionth."""
    return {f"{ROUNDING}.step": (step, 1e-6 * step, unit)}


def quantization(fit: Misfit, nominal_sigma: float) -> StochasticFit | None:
    """Interval likelihood of rounded data, the noise before rounding white."""
    measured = fit.measured
    step = lattice_step(only_read(measured, fit.unread))
    if step == 0:
        return None
    e = np.concatenate(only_read(fit.residuals, fit.unread))
    candidates = step * np.geomspace(0.02, 1.0, 30)
    totals = [
        float(np.sum(_log_interval((e - 0.5 * step) / s, (e + 0.5 * step) / s))) - len(e) * np.log(step)
        for s in candidates
    ]
    best = int(np.argmax(totals))
    sigma = float(candidates[best])
    reference = min(sigma, nominal_sigma) if np.isfinite(nominal_sigma) and nominal_sigma > 0 else sigma
    if step < SMALLEST_STEP * reference:
        return None
    display = RoundedDisplay(step, float(measured[0][0]), sigma)
    left = [
        y - display.show(s, record) for record, (y, s) in enumerate(zip(measured, fit.simulated, strict=True))
    ]
    spread = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
    whitener = Plain(max(spread, 0.3 * sigma), totals[best], masked=tuple(fit.unread or ()))
    return StochasticFit(
        ROUNDING,
        "",
        whitener,
        totals[best],
        rounding_step(step, fit.scale.units.output),
        display,
    )


def _log_interval(low: FloatArray, high: FloatArray) -> FloatArray:
    """log(Phi(high) - Phi(low)), far tails included."""
    flip = low > 0
    a, b = np.where(flip, -high, low), np.where(flip, -low, high)
    upper, lower = log_ndtr(b), log_ndtr(a)
    return upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-12)))
