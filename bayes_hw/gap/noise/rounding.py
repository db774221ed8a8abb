"""encoder_quantization: y lies on a lattice whose step is well above the noise (interval likelihood).

A rounding error of a moving axis is white and uniform over a step (Widrow and Kollar, Quantization Noise,
2008), of variance step^2 / 12, which is what the likelihood of slow noise takes it for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import log_ndtr

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.display_kernel import rounded_log_likelihood
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.random_cause import ROUNDING
from bayes_hw.gap.noise.state_noise import StateNoise
from bayes_hw.gap.noise.stochastic_fit import StochasticFit
from bayes_hw.gap.noise.whitener import Plain, Whitener, only_read

SMALLEST_STEP = 1.8
"""Of the noise: a coarser lattice of y is quantization, a finer one is not told from noise."""


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
class SecondRounding:
    """Rounding to a lattice of `step`, output units; see `SecondCause`."""

    label: ClassVar[str] = ROUNDING
    form: ClassVar[str] = "with rounding"
    rounds: ClassVar[int] = 0
    log_likelihood: ClassVar[float] = 0.0

    misfit: Misfit
    step: float

    @classmethod
    def of(cls, fit: Misfit) -> SecondRounding | None:
        """That of the measured values; None where they lie on no lattice."""
        step = lattice_step(only_read(fit.measured, fit.unread))
        return cls(fit, step) if step else None

    @property
    def variances(self) -> list[FloatArray]:
        return [np.full(len(e), self.step**2 / 12) for e in self.misfit.residuals]

    @property
    def parameters(self) -> dict[str, tuple[float, float, str]]:
        return rounding_step(self.step, self.misfit.scale.units.output)

    def beside(self, noise: StateNoise) -> SecondRounding:  # noqa: ARG002
        """The lattice is a fact."""
        return self


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


def _log_interval(low: FloatArray, high: FloatArray) -> FloatArray:
    """log(Phi(high) - Phi(low)), far tails included."""
    flip = low > 0
    a, b = np.where(flip, -high, low), np.where(flip, -low, high)
    upper, lower = log_ndtr(b), log_ndtr(a)
    return upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-12)))
