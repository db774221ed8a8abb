"""Samples off their instants beside slow noise.

What untimely samples add is white, of a variance that follows the motion; slow noise is smooth from sample
to sample. So the one shows in how far samples stand off their neighbours, the other in what these have in
common.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from scipy.optimize import minimize

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.clock_jitter import CLOCK_SD, Untimely
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.random_cause import JITTER
from bayes_hw.gap.noise.slow_noise import CURVATURE_STEP
from bayes_hw.gap.noise.state_noise import StateNoise, View

CERTAIN = 5.0
"""Standard deviations by which the spread about neighbours must grow with the speed."""

EVALUATIONS = 30
FARTHEST = 4.0
"""Standard deviations to which departures from neighbours are clipped: glitches are no jitter."""

DEPARTURE = 1.5
"""Variance of white noise less the mean of its neighbours, over its own."""


@dataclass(frozen=True)
class SecondJitter:
    """Samples off their instants by a clock of variance `square`, s^2, with the `curvature` of the
    log-likelihood in log tau; see `SecondCause`."""

    label: ClassVar[str] = JITTER.label
    form: ClassVar[str] = "with clock jitter"
    rounds: ClassVar[int] = 2
    log_likelihood: ClassVar[float] = 0.0

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
