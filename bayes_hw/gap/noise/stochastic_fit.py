"""Noise with a random cause in it: what a kind of noise has found in the residuals of a fit.

A random cause changes the noise, not the response: no simulator can track its realisation, so what it
improves is the predictive density and the band.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.random_cause import RANDOM_CAUSES, RandomCause
from bayes_hw.gap.noise.whitener import Autoregression, Whitener, fit_autoregression, no_glitches

NOISE_ORDER = 1


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


def autoregression(fit: Misfit) -> Autoregression:
    """Autoregressive noise of the fit's residuals, no glitches masked."""
    return fit_autoregression(fit.residuals, no_glitches(fit.residuals), NOISE_ORDER, fit.unread)
