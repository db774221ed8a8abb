"""The exact likelihood of records whose encoder repeats samples or rounds them, and its maximum.

The search for effects takes the expected display for what the encoder shows, which is fast and a little
biased. What is reported rests on the likelihood itself, with the noise's own parameters free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.optimize import minimize

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.explanation import Explanation, with_stochastic
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.display_kernel import held_log_likelihood, rounded_log_likelihood
from bayes_hw.gap.noise.spectra import LARGEST_NOISE_CORRELATION
from bayes_hw.gap.noise.stochastic import (
    HeldDisplay,
    RoundedDisplay,
    StochasticFit,
    held_samples,
    quantization,
)
from bayes_hw.gap.noise.whitener import Autoregression
from bayes_hw.gap.search.attribute import Attribution

STEP = 0.05
"""Of a standard deviation: the difference of the derivatives."""

ITERATIONS = 25
WORST = 1e12

EXACT_SETS = 4


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

    def __call__(self, simulated: Sequence[FloatArray], noise: FloatArray) -> FloatArray:
        total, sigma = np.zeros(len(noise)), self.sigma(noise)
        for y, s in zip(self.measured, simulated, strict=True):
            rounded_log_likelihood(y, np.ascontiguousarray(s), self.step, sigma, total)
            total -= len(y) * np.log(self.step)
        return total

    def sigma(self, noise: FloatArray) -> FloatArray:
        return np.exp(noise[:, 0])


def display_likelihood(explanation: Explanation) -> DisplayLikelihood | None:
    """The exact likelihood of an explanation by a display, None for any other."""
    stochastic, measured = explanation.stochastic, explanation.fit.measured
    if stochastic is None or stochastic.display is None:
        return None
    samples = sum(len(y) for y in measured)
    if isinstance(stochastic.display, RoundedDisplay):
        display = stochastic.display
        return RoundedLikelihood(
            measured, display.step, np.array([np.log(display.sigma)]), np.array([3 / np.sqrt(samples)])
        )
    hold, error, _ = stochastic.parameters["timing_jitter.repeated_share"]
    whitener = explanation.fit.whitener
    assert isinstance(whitener, Autoregression)
    correlation = float(np.clip(whitener.coefficients[0], 0.0, 0.95)) / LARGEST_NOISE_CORRELATION
    sigma = whitener.sigma * np.sqrt(1 - (correlation * LARGEST_NOISE_CORRELATION) ** 2)
    start = np.array([np.log(hold / (1 - hold)), np.log(sigma), np.arctanh(min(correlation, 0.99))])
    spreads = np.array([error / (hold * (1 - hold)), 1 / np.sqrt(2 * samples), 1 / np.sqrt(samples)])
    return HeldLikelihood(measured, start, spreads)


class DisplayDensity:
    """Log-posterior of response coordinates and noise coordinates together, in units of their spread.

    `centre` and `factor` map standard points (n, dimension) to coordinates.
    """

    def __init__(self, explanation: Explanation, likelihood: DisplayLikelihood) -> None:
        best = explanation.fit
        self.hypothesis: Hypothesis = best.hypothesis
        self.likelihood = likelihood
        self.count = len(best.coordinates)
        self.centre = np.concatenate([best.coordinates, likelihood.start])
        self.factor = np.zeros((len(self.centre), len(self.centre)))
        self.factor[: self.count, : self.count] = np.linalg.cholesky(best.covariance())
        self.factor[self.count :, self.count :] = np.diag(likelihood.spreads)

    def coordinates(self, points: FloatArray) -> FloatArray:
        """Coordinates (n, dimension) of standard points."""
        return self.centre + points @ self.factor.T

    def __call__(self, points: FloatArray) -> FloatArray:
        """Log-density (n,) at standard points (n, dimension), up to a constant."""
        where = self.coordinates(points)
        response, noise = where[:, : self.count], where[:, self.count :]
        totals = self.hypothesis.log_prior(response)
        simulated = self.hypothesis.simulate_batch(self.hypothesis.to_values(response))
        totals += self.likelihood(simulated, noise)
        return np.where(np.isfinite(totals), totals, -np.inf)

    def mode(self) -> tuple[FloatArray, FloatArray]:
        """Standard coordinates of the maximum and the covariance about it, by quasi-Newton steps."""
        dimension = len(self.centre)
        moves = STEP * np.eye(dimension)

        def cost(point: FloatArray) -> tuple[float, FloatArray]:
            around = self(np.concatenate([point[None], point + moves, point - moves]))
            around = np.where(np.isfinite(around), around, -WORST)
            gradient = (around[1 : dimension + 1] - around[dimension + 1 :]) / (2 * STEP)
            return -float(around[0]), -gradient

        found = minimize(
            cost,
            np.zeros(dimension),
            jac=True,
            method="BFGS",
            options={"maxiter": ITERATIONS, "gtol": 0.05},
        )
        return np.asarray(found.x), np.asarray(found.hess_inv)


def at_exact_maximum(explanation: Explanation) -> Explanation:
    """The explanation at the maximum of its exact likelihood; itself where it has no display."""
    likelihood = display_likelihood(explanation)
    stochastic = explanation.stochastic
    if likelihood is None or stochastic is None:
        return explanation
    density = DisplayDensity(explanation, likelihood)
    mode, _ = density.mode()
    if density(mode[None])[0] < density(np.zeros_like(mode)[None])[0]:
        mode = np.zeros_like(mode)
    coordinates = density.coordinates(mode[None])[0]
    best, hypothesis = explanation.fit, density.hypothesis
    response, noise = coordinates[: density.count], coordinates[density.count :][None]
    simulated = hypothesis.simulate(hypothesis.to_values(response))
    residuals = [y - s for y, s in zip(best.measured, simulated, strict=True)]
    moved = replace(best, coordinates=response, simulated=simulated, residuals=residuals)
    kind = held_samples if isinstance(stochastic.display, HeldDisplay) else _rounding
    found = replace(
        kind(moved) or stochastic,
        log_likelihood=float(likelihood([y[:, None] for y in simulated], noise)[0]),
        encoder_sigma=float(likelihood.sigma(noise)[0]),
    )
    return with_stochastic(found, moved)


def with_exact_maxima(attribution: Attribution, near: Explanation) -> Attribution:
    """The attribution with what is held against `near`, an explanation by a display, at exact maxima.

    Those are the display alone and the best sets that hold it; the others stand too far below to matter.
    """
    stochastic = near.stochastic
    if stochastic is None or stochastic.display is None:
        return attribution
    best: dict[tuple[str, ...], Explanation] = {}
    for e in sorted(attribution.explanations, key=lambda e: -e.log_evidence):
        if e.stochastic is not None and type(e.stochastic.display) is type(stochastic.display):
            best.setdefault(e.labels, e)
    chosen = [near, *(e for e in best.values() if e is not near)][:EXACT_SETS]
    alone = best.get((stochastic.label,))
    if alone is not None and not any(e is alone for e in chosen):
        chosen.append(alone)
    exact = {id(e): at_exact_maximum(e) for e in chosen}
    known = {e.labels for e in chosen}
    others = [
        e
        for e in attribution.explanations
        if id(e) in exact or e.labels not in known or e.stochastic is None or e.stochastic.display is None
    ]
    moved = sorted((exact.get(id(e), e) for e in others), key=lambda e: -e.log_evidence)
    return replace(attribution, explanations=tuple(moved))


def _rounding(fit: Fit) -> StochasticFit | None:
    return quantization(fit, np.inf)
