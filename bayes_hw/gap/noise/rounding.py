"""encoder_quantization: y lies on a lattice whose step is well above the noise (interval likelihood).

A rounding error of a moving axis is white and uniform over a step (Widrow and Kollar, Quantization Noise,
2008), of variance step^2 / 12, which is what the likelihood of slow noise takes it for.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.optimize import minimize
from scipy.special import log_ndtr

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.lattice import lattice_step
from bayes_hw.gap.noise.display_kernel import rounded_log_likelihood
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.random_cause import ROUNDING
from bayes_hw.gap.noise.state_noise import StateNoise
from bayes_hw.gap.noise.stochastic_fit import StochasticFit
from bayes_hw.gap.noise.whitener import Plain, Whitener, fit_autoregression, no_glitches, only_read

SMALLEST_STEP = 1.8
"""Of the noise: a coarser lattice of y is quantization, a finer one is not told from noise."""

LEAST_ANGLE = 0.02
"""Of a step: standard deviation of an angle before rounding, at least."""

COLOUR_NATS = 10.0
"""By which noise before the rounding must be likelier with a correlation than white."""

REFINING_EVALUATIONS = 60


@dataclass(frozen=True)
class RoundedLikelihood:
    """Rounding to a lattice of known step under noise of first order: the logarithm of the noise and, where
    that is not white, the inverse hyperbolic tangent of its correlation.

    A probability of a lattice point over the step is comparable with the densities of other explanations.
    """

    measured: Sequence[FloatArray]
    step: float
    start: FloatArray
    spreads: FloatArray

    @classmethod
    def near(
        cls, step: float, sigma: float, measured: Sequence[FloatArray], correlation: float = 0.0
    ) -> RoundedLikelihood:
        """Of `measured` (samples,), a record each, on a lattice of `step`, near a noise of `sigma` and
        `correlation`, white where that is 0."""
        samples = sum(len(y) for y in measured)
        start = [np.log(sigma), np.arctanh(correlation)] if correlation else [np.log(sigma)]
        return cls(measured, step, np.array(start), np.full(len(start), 3 / np.sqrt(samples)))

    def __call__(self, simulated: Sequence[FloatArray], noise: FloatArray) -> FloatArray:
        total, sigma = np.zeros(len(noise)), self.sigma(noise)
        correlation = np.tanh(noise[:, 1]) if noise.shape[1] > 1 else np.zeros(len(noise))
        for y, s in zip(self.measured, simulated, strict=True):
            simulation = np.ascontiguousarray(s)
            rounded_log_likelihood(y, simulation, self.step, sigma, correlation, total)
            total -= len(y) * np.log(self.step)
        return total

    def sigma(self, noise: FloatArray) -> FloatArray:
        return np.exp(noise[:, 0])


@dataclass(frozen=True)
class RoundedDisplay:
    """Rounding of y + noise to a lattice: its mean, a staircase with steps as soft as the noise, which is of
    first order."""

    step: float
    offset: float
    sigma: float
    correlation: float = 0.0

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
        return RoundedLikelihood.near(self.step, self.sigma, measured, self.correlation)

    def found_again(self, fit: Misfit) -> StochasticFit | None:
        return quantization(fit, np.inf)


@dataclass(frozen=True)
class SecondRounding:
    """Rounding to a lattice of `step`, output units; see `SecondCause`."""

    label: ClassVar[str] = ROUNDING
    form: ClassVar[str] = "with rounding"
    rounds: ClassVar[int] = 0

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

    def log_likelihood(self, noise: StateNoise) -> float:
        return of_lattice(self.misfit.residuals, self.step, noise)

    def beside(self, noise: StateNoise) -> SecondRounding:  # noqa: ARG002
        """The lattice is a fact."""
        return self


def of_lattice(residuals: Sequence[FloatArray], step: float, noise: StateNoise) -> float:
    """By how much the residuals (samples,) of all records are likelier as points of a lattice of `step` than
    as densities under `noise`, which holds the variance of their rounding: a filter that follows a reading
    which stands still would have it likelier than certain."""
    total, half = 0.0, 0.5 * step
    for record, e in enumerate(residuals):
        white, roots = noise.innovations(e, record)
        white, roots = white[np.isfinite(roots)], roots[np.isfinite(roots)]
        angles = np.sqrt(np.maximum(roots**2 - step**2 / 12, (LEAST_ANGLE * step) ** 2))
        errors = white * roots
        masses = _log_interval((errors - half) / angles, (errors + half) / angles) - np.log(step)
        densities = -0.5 * (white**2 + np.log(2 * np.pi)) - np.log(roots)
        total += float(np.sum(masses - densities))
    return total


def quantization(fit: Misfit, nominal_sigma: float) -> StochasticFit | None:
    """Interval likelihood of rounded data, the noise before rounding white, or of first order where that is
    likelier."""
    found = _on_lattice(fit, nominal_sigma)
    if found is None:
        return None
    rounded, simulated, white = found
    measured, step = fit.measured, rounded.step

    def cost(noise: FloatArray) -> float:
        return -_total(rounded, simulated, noise)

    coloured = minimize(
        cost,
        np.append(white, 0.5),
        method="Nelder-Mead",
        options={"maxfev": REFINING_EVALUATIONS, "xatol": 1e-3, "fatol": 0.1},
    )
    sigma, correlation, total = float(np.exp(white[0])), 0.0, _total(rounded, simulated, white)
    if -coloured.fun > total + COLOUR_NATS:
        sigma, correlation = float(np.exp(coloured.x[0])), float(np.tanh(coloured.x[1]))
        total = -float(coloured.fun)
    display = RoundedDisplay(step, float(measured[0][0]), sigma, correlation)
    left = [
        y - display.show(s, record) for record, (y, s) in enumerate(zip(measured, fit.simulated, strict=True))
    ]
    spread = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
    whitener: Whitener = Plain(max(spread, 0.3 * sigma), total, masked=tuple(fit.unread or ()))
    if correlation:
        whitener = replace(fit_autoregression(left, no_glitches(left), 1, fit.unread), log_likelihood=total)
    return StochasticFit(
        ROUNDING,
        "",
        whitener,
        total,
        rounding_step(step, fit.scale.units.output),
        display,
    )


def is_rounded(fit: Misfit, nominal_sigma: float) -> bool:
    """Whether the measured values lie on a lattice well above the noise."""
    return _on_lattice(fit, nominal_sigma) is not None


def _on_lattice(
    fit: Misfit, nominal_sigma: float
) -> tuple[RoundedLikelihood, list[FloatArray], FloatArray] | None:
    """The likelihood of what was read, what was simulated for it, (samples, 1) a record, and the logarithm
    of the white noise that suits both best, (1,); None where no lattice is well above the noise."""
    read = only_read(fit.measured, fit.unread)
    step = lattice_step(read)
    if step == 0:
        return None
    errors = only_read(fit.residuals, fit.unread)
    simulated = [(y - e)[:, None] for y, e in zip(read, errors, strict=True)]
    rounded = RoundedLikelihood.near(step, step, read)
    white = _likeliest_white(rounded, simulated)
    sigma = float(np.exp(white[0]))
    known = np.isfinite(nominal_sigma) and nominal_sigma > 0
    if step < SMALLEST_STEP * (min(sigma, nominal_sigma) if known else sigma):
        return None
    return rounded, simulated, white


def _total(rounded: RoundedLikelihood, simulated: Sequence[FloatArray], noise: FloatArray) -> float:
    return float(rounded(simulated, noise[None, :])[0])


def _likeliest_white(rounded: RoundedLikelihood, simulated: Sequence[FloatArray]) -> FloatArray:
    """The logarithm of white noise before the rounding, (1,), on a grid up to the step."""
    grid = np.log(rounded.step * np.geomspace(0.02, 1.0, 30))[:, None]
    return np.asarray(max(grid, key=lambda noise: _total(rounded, simulated, noise)))


def rounding_step(step: float, unit: str) -> dict[str, tuple[float, float, str]]:
    """The parameter of a rounding encoder, known to a millionth."""
    return {f"{ROUNDING}.step": (step, 1e-6 * step, unit)}


def _log_interval(low: FloatArray, high: FloatArray) -> FloatArray:
    """log(Phi(high) - Phi(low)), far tails included."""
    flip = low > 0
    a, b = np.where(flip, -high, low), np.where(flip, -low, high)
    upper, lower = log_ndtr(b), log_ndtr(a)
    return upper + np.log1p(-np.exp(np.minimum(lower - upper, -1e-12)))
