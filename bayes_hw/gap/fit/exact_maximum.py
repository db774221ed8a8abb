"""Explanations by an encoder that repeats or rounds, at the maximum of their exact likelihood.

The search for effects takes the expected display for what the encoder shows, which is fast and a little
biased. What is reported rests on the likelihood itself, with the noise's own parameters free.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.explanation import Explanation, with_stochastic
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.stochastic_fit import DisplayLikelihood

STEP = 0.05
"""Of a standard deviation: the difference of the derivatives."""

ITERATIONS = 25
WORST = 1e12

EXACT_SETS = 4


def exact_likelihood(explanation: Explanation) -> DisplayLikelihood | None:
    """That of an explanation by a display, None for any other."""
    display, best = explanation.display, explanation.fit
    return None if display is None else display.likelihood(best.measured, best.whitener)


class DisplayDensity:
    """Log-posterior of response coordinates and noise coordinates together, in units of their spread.

    `centre` and `factor` map standard points (n, dimension) to coordinates.
    """

    def __init__(self, best: Fit, likelihood: DisplayLikelihood) -> None:
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
    likelihood, stochastic = exact_likelihood(explanation), explanation.stochastic
    if likelihood is None or stochastic is None or stochastic.display is None:
        return explanation
    density = DisplayDensity(explanation.fit, likelihood)
    mode, _ = density.mode()
    if density(mode[None])[0] < density(np.zeros_like(mode)[None])[0]:
        mode = np.zeros_like(mode)
    coordinates = density.coordinates(mode[None])[0]
    best, hypothesis = explanation.fit, density.hypothesis
    response, noise = coordinates[: density.count], coordinates[density.count :][None]
    simulated = hypothesis.simulate(hypothesis.to_values(response))
    residuals = [y - s for y, s in zip(best.measured, simulated, strict=True)]
    moved = replace(best, coordinates=response, simulated=simulated, residuals=residuals)
    found = replace(
        stochastic.display.found_again(moved) or stochastic,
        log_likelihood=float(likelihood([y[:, None] for y in simulated], noise)[0]),
        encoder_sigma=float(likelihood.sigma(noise)[0]),
    )
    return with_stochastic(found, moved)


def with_exact_maxima(explanations: Sequence[Explanation], near: Explanation) -> tuple[Explanation, ...]:
    """The same with what is held against `near`, an explanation by a display, at exact maxima; best first.

    Those are the display alone and the best sets that hold it; the others stand too far below to matter.
    """
    stochastic = near.stochastic
    if stochastic is None or stochastic.display is None:
        return tuple(explanations)
    best: dict[tuple[str, ...], Explanation] = {}
    for e in sorted(explanations, key=lambda e: -e.log_evidence):
        own = e.stochastic
        if own is not None and own.display is not None and own.label == stochastic.label:
            best.setdefault(e.labels, e)
    chosen = [near, *(e for e in best.values() if e is not near)][:EXACT_SETS]
    alone = best.get((stochastic.label,))
    if alone is not None and not any(e is alone for e in chosen):
        chosen.append(alone)
    exact = {id(e): at_exact_maximum(e) for e in chosen}
    known = {e.labels for e in chosen}
    others = [
        e
        for e in explanations
        if id(e) in exact or e.labels not in known or e.stochastic is None or e.stochastic.display is None
    ]
    return tuple(sorted((exact.get(id(e), e) for e in others), key=lambda e: -e.log_evidence))
