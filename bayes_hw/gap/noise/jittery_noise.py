"""Slow noise and samples off their instants at once: two stochastic effects in one likelihood.

What untimely samples add is white, of a variance that follows the motion; slow noise is smooth from sample
to sample. So the one shows in how far samples stand off their neighbours, the other in what these have in
common.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.clock_jitter import CLOCK_SD, Untimely
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.slow_noise import CURVATURE_STEP, random_walk, wind
from bayes_hw.gap.noise.state_noise import StateNoise, View
from bayes_hw.gap.noise.stochastic import StochasticFit

WITH_JITTER = "with clock jitter"

CERTAIN = 5.0
"""Standard deviations by which the spread about neighbours must grow with the speed."""

ROUNDS = 2
"""Of the slow noise given the jitter, and of the jitter given the slow noise."""

EVALUATIONS = 30
FARTHEST = 4.0
"""Standard deviations to which departures from neighbours are clipped: glitches are no jitter."""

DEPARTURE = 1.5
"""Variance of white noise less the mean of its neighbours, over its own."""


def wind_and_jitter(fit: Misfit, start: FloatArray | None = None) -> StochasticFit | None:
    """Wind with clock jitter beside it, None where no spread grows with the speed; `start` as for `wind`."""
    return _with_jitter(wind, fit, start)


def walk_and_jitter(fit: Misfit, start: FloatArray | None = None) -> StochasticFit | None:
    """A wandering encoder with clock jitter, None where no spread grows with the speed."""
    return _with_jitter(random_walk, fit, start)


def _with_jitter(
    kind: Callable[..., StochasticFit | None], fit: Misfit, start: FloatArray | None
) -> StochasticFit | None:
    untimely = Untimely.of(fit)
    square = spread_with_speed(fit.residuals, untimely.speeds)
    if square == 0:
        return None
    curvature = 1.0
    for _ in range(ROUNDS):
        slow = kind(fit, start, untimely.variances(square))
        if slow is None or not isinstance(slow.whitener, StateNoise):
            return None
        start = slow.point
        square, curvature = _refined(fit, slow.whitener, untimely, square)
    slow = kind(fit, start, untimely.variances(square))
    if slow is None:
        return None
    spread = float(np.sqrt(square))
    error = float(spread / np.sqrt(max(curvature, 1.0)))
    return slow.with_second("timing_jitter", WITH_JITTER, {CLOCK_SD: (spread, error, "s")})


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
