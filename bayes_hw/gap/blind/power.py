"""The smallest gap at which an effect is named right with a stated probability."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import optimize, special

from bayes_hw.arrays import FloatArray

PROBABILITY = 0.9
PRIOR_SD = 4.0
BOOTSTRAPS = 200


@dataclass(frozen=True)
class SmallestGap:
    """The gap over sigma where P(named right) passes PROBABILITY, with its 95 % interval.

    An end of the interval that lies beyond the gaps tried is given as infinity, or as zero.
    """

    gap: float
    interval: tuple[float, float]
    trials: int


def smallest_gap(gaps: Sequence[float], right: Sequence[bool], rng: np.random.Generator) -> SmallestGap:
    """Logistic regression of `right` on log gap, P = 1 / (1 + exp(-(a + b log g))) with b > 0; bootstrapped.

    Weak Gaussian priors (standard deviation 4 on a and on log b) keep the fit finite where all small gaps
    are wrong and all large ones right. Gaps are over sigma.
    """
    x, y = np.log(np.asarray(gaps, dtype=np.float64)), np.asarray(right, dtype=np.float64)
    found = _threshold(_fit(x, y))
    draws = []
    for _ in range(BOOTSTRAPS):
        chosen = rng.integers(len(x), size=len(x))
        draws.append(_threshold(_fit(x[chosen], y[chosen])))
    low, high = np.quantile(draws, [0.025, 0.975])
    smallest, largest = float(np.exp(x.min())), float(np.exp(x.max()))
    return SmallestGap(
        _within(found, smallest, largest),
        (_within(float(low), smallest, largest), _within(float(high), smallest, largest)),
        len(x),
    )


def _fit(x: FloatArray, y: FloatArray) -> FloatArray:
    """a and log b at the largest posterior density."""

    def cost(parameters: FloatArray) -> tuple[float, FloatArray]:
        slope = np.exp(parameters[1])
        z = parameters[0] + slope * x
        error = special.expit(z) - y
        value = np.sum(np.logaddexp(0, z) - y * z) + 0.5 * np.sum((parameters / PRIOR_SD) ** 2)
        gradient = np.array([error.sum(), (error * x).sum() * slope]) + parameters / PRIOR_SD**2
        return float(value), gradient

    bounds = [(-30.0, 30.0), (-3.0, 3.0)]
    found = optimize.minimize(cost, np.array([0.0, 1.0]), jac=True, bounds=bounds, method="L-BFGS-B")
    return np.asarray(found.x, dtype=np.float64)


def _threshold(parameters: FloatArray) -> float:
    log_gap = (special.logit(PROBABILITY) - parameters[0]) / np.exp(parameters[1])
    return float(np.exp(np.clip(log_gap, -20, 20)))


def _within(gap: float, smallest: float, largest: float) -> float:
    """The gap where gaps were tried; beyond them only the side is known."""
    if gap < smallest:
        return 0.0
    return gap if gap <= largest else float("inf")
