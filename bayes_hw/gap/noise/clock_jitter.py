"""timing_jitter (clock): samples taken off their instants by epsilon ~ N(0, tau^2).

The error is white, of a variance that changes with the motion: the mean square of y(t + epsilon) - y(t) is
tau^2 y'^2 + tau^4 (3/4 y''^2 + y' y''') to fourth order, the derivatives those of a cubic spline: differences
of samples lose the speed of vibrations.

Beside slow noise, which is smooth from sample to sample, it shows in how far samples stand off their
neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.noise_kernel import jitter_filter, untimely_variance
from bayes_hw.gap.noise.random_cause import JITTER
from bayes_hw.gap.noise.spectra import LARGEST_NOISE_CORRELATION
from bayes_hw.gap.noise.state_noise import CURVATURE_STEP, StateNoise, View
from bayes_hw.gap.noise.stochastic_fit import StochasticFit, autoregression
from bayes_hw.gap.noise.whitener import LOG_2PI, Homogeneous
from bayes_hw.gap.simulate.columns import square_sums

CLOCK_SD = "timing_jitter.clock_sd"

CERTAIN = 5.0
"""Standard deviations by which the spread about neighbours must grow with the speed."""

EVALUATIONS = 30
FARTHEST = 4.0
"""Standard deviations to which departures from neighbours are clipped: glitches are no jitter."""

DEPARTURE = 1.5
"""Variance of white noise less the mean of its neighbours, over its own."""

LEAST_OF_SPEED = 0.3
"""Of what the speed alone makes of an untimely sample: where the expansion gives less, it ends."""


@dataclass(frozen=True)
class JitterWhitener(Homogeneous):
    """First-order noise and white noise of changing variance."""

    coefficient: float
    innovation_variance: float
    extra: tuple[FloatArray, ...]
    log_likelihood: float
    parameter_count: int = 3

    @property
    def correlation(self) -> float:
        return self.coefficient

    @property
    def sigma(self) -> float:
        return float(np.sqrt(self.innovation_variance / (1 - self.coefficient**2)))

    def evened(self, residuals: Sequence[FloatArray]) -> list[FloatArray]:
        return [e / np.sqrt(1 + x / self.sigma**2) for e, x in zip(residuals, self.extra, strict=True)]

    def whiten(self, columns: FloatArray, record: int) -> FloatArray:
        white = np.empty_like(columns)
        jitter_filter(
            np.ascontiguousarray(columns),
            self.coefficient,
            self.innovation_variance,
            self.extra[record],
            white,
        )
        return white


@dataclass(frozen=True)
class Untimely:
    """The motion that untimely samples show: squares of the `speeds` (samples,) and the factors `bends` of
    tau^4, a record each."""

    speeds: tuple[FloatArray, ...]
    bends: tuple[FloatArray, ...]

    @classmethod
    def of(cls, fit: Misfit) -> Untimely:
        """Of the motion that `fit` simulates."""
        rate = fit.scale.rate
        splines = [CubicSpline(np.arange(len(s)) / rate, s) for s in fit.simulated]
        speeds, turns = ([spline(spline.x, order) for spline in splines] for order in (1, 2))
        bends = (
            0.75 * a**2 + v * rate**2 * np.diff(v, 2, prepend=v[0], append=v[-1])
            for v, a in zip(speeds, turns, strict=True)
        )
        return cls(tuple(v**2 for v in speeds), tuple(bends))

    @property
    def power(self) -> float:
        """Mean square of the speed."""
        return float(np.mean(np.concatenate(self.speeds)))

    def variances(self, square: float) -> tuple[FloatArray, ...]:
        """Of the error (samples,), a record each, for tau^2 = `square` in s^2."""
        return tuple(
            untimely_variance(square, speed, bend, LEAST_OF_SPEED)
            for speed, bend in zip(self.speeds, self.bends, strict=True)
        )


def clock_jitter(fit: Misfit) -> StochasticFit | None:
    """First-order noise and samples off their instants, None without motion."""
    noise = autoregression(fit)
    untimely = Untimely.of(fit)
    if untimely.power == 0:
        return None
    correlation = float(np.clip(noise.coefficients[0], 0.0, LARGEST_NOISE_CORRELATION))

    def at(p: FloatArray) -> JitterWhitener:
        coefficient = LARGEST_NOISE_CORRELATION / (1 + np.exp(-p[0]))
        variance = np.exp(2 * p[1])
        extra = untimely.variances(float(np.exp(2 * p[2])))
        if fit.unread is not None:
            extra = tuple(np.where(mask, np.inf, r) for mask, r in zip(fit.unread, extra, strict=True))
        total = -0.5 * fit.readings * LOG_2PI
        for e, r in zip(fit.residuals, extra, strict=True):
            white = np.empty((len(e), 1))
            log_determinant = jitter_filter(e[:, None], coefficient, variance, r, white)
            total -= 0.5 * (log_determinant + float(square_sums(white)[0]))
        return JitterWhitener(float(coefficient), float(variance), extra, total)

    def cost(p: FloatArray) -> float:
        return -at(p).log_likelihood

    first = np.log(max(correlation, 0.02) / (LARGEST_NOISE_CORRELATION * 1.001 - max(correlation, 0.02)))
    best = None
    for share in (0.3, 0.8):
        start = np.array([first, 0.5 * np.log(1 - share), 0.5 * np.log(share / untimely.power)])
        start[1:] += np.log(noise.innovation_sigma)
        found = minimize(cost, start, method="Nelder-Mead", options={"maxiter": 120, "fatol": 0.1})
        if best is None or found.fun < best.fun:
            best = found
    assert best is not None
    whitener = at(best.x)
    spread = float(np.exp(best.x[2]))
    samples = fit.readings
    return StochasticFit(
        JITTER.label,
        "clock",
        whitener,
        whitener.log_likelihood,
        {CLOCK_SD: (spread, spread / np.sqrt(0.5 * samples), "s")},
    )


@dataclass(frozen=True)
class SecondJitter:
    """Samples off their instants by a clock of variance `square`, s^2, with the `curvature` of the
    log-likelihood in log tau; see `SecondCause`."""

    label: ClassVar[str] = JITTER.label
    form: ClassVar[str] = "with clock jitter"
    rounds: ClassVar[int] = 2

    misfit: Misfit
    untimely: Untimely
    square: float
    curvature: float = 1.0

    @classmethod
    def of(cls, fit: Misfit) -> SecondJitter | None:
        """That of the residuals; None where no spread grows with the speed."""
        untimely = Untimely.of(fit)
        square = spread_with_speed(fit.residuals, untimely.speeds)
        return cls(fit, untimely, square) if square else None

    @property
    def variances(self) -> tuple[FloatArray, ...]:
        return self.untimely.variances(self.square)

    @property
    def parameters(self) -> dict[str, tuple[float, float, str]]:
        spread = float(np.sqrt(self.square))
        return {CLOCK_SD: (spread, float(spread / np.sqrt(max(self.curvature, 1.0))), "s")}

    def log_likelihood(self, noise: StateNoise) -> float:  # noqa: ARG002
        return 0.0

    def beside(self, noise: StateNoise) -> SecondJitter:
        """tau^2 of most likelihood, the encoder's own noise free."""
        square, curvature = _refined(self.misfit, noise, self.untimely, self.square)
        return replace(self, square=square, curvature=curvature)


def spread_with_speed(residuals: Sequence[FloatArray], squares: Sequence[FloatArray]) -> float:
    """tau^2 in s^2 that the departures of samples from their neighbours say, zero where it is not CERTAIN.

    `squares` (samples,) are those of the speed, a record each.
    """
    departures = np.concatenate([e[1:-1] - 0.5 * (e[:-2] + e[2:]) for e in residuals])
    speeds = np.concatenate([v[1:-1] for v in squares])
    usual = float(np.median(departures**2)) / 0.455
    power = np.minimum(departures**2, FARTHEST**2 * usual)
    if np.ptp(speeds) == 0 or np.ptp(power) == 0:
        return 0.0
    covariance = np.cov(speeds, power)
    certainty = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1]) * np.sqrt(len(power))
    return float(covariance[0, 1] / covariance[0, 0] / DEPARTURE) if certainty > CERTAIN else 0.0


def _refined(fit: Misfit, noise: StateNoise, untimely: Untimely, square: float) -> tuple[float, float]:
    """tau^2 of most likelihood beside slow `noise`, which holds it at `square`, the encoder's own noise free;
    with the curvature in log tau."""
    views, held = noise.views or (), untimely.variances(square)

    def cost(p: FloatArray) -> float:
        moved = tuple(
            View(view.share, view.doubt - old + new, view.strength)
            for view, old, new in zip(views, held, untimely.variances(float(np.exp(2 * p[0]))), strict=True)
        )
        value = (
            -replace(noise.with_encoder(float(np.exp(p[1]))), views=moved)
            .fitted_to(fit.residuals)
            .log_likelihood
        )
        return value if np.isfinite(value) else 1e300

    start = np.log([np.sqrt(square), noise.sigma])
    found = minimize(
        cost,
        start,
        method="Nelder-Mead",
        options={
            "maxfev": EVALUATIONS,
            "fatol": 0.1,
            "initial_simplex": np.vstack([start, start + 0.2 * np.eye(2)]),
        },
    )
    step = np.array([CURVATURE_STEP, 0.0])
    curvature = (cost(found.x + step) - 2 * found.fun + cost(found.x - step)) / CURVATURE_STEP**2
    return float(np.exp(2 * found.x[0])), float(curvature)
