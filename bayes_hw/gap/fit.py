"""Least squares of one hypothesis: Levenberg-Marquardt on whitened residuals with the priors' pull."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.hypothesis import Hypothesis
from bayes_hw.gap.whitener import Whitener

MAX_ITERATIONS = 25
GOOD_ENOUGH = 1e-6
"""Relative decrease of the cost at which the iteration ends."""

FARTHEST = 8.0
"""Prior standard deviations that a coordinate may move from the prior mean."""


@dataclass(frozen=True)
class Fit:
    """A hypothesis at its best coordinates.

    `residuals` are measured minus simulated outputs, a record each; `jacobians` (samples, parameters) the
    derivatives of the simulated outputs; `cost` half the sum of squares of whitened residuals and priors.
    """

    hypothesis: Hypothesis
    coordinates: FloatArray
    residuals: list[FloatArray]
    simulated: list[FloatArray]
    jacobians: list[FloatArray]
    whitener: Whitener
    cost: float

    @property
    def values(self) -> FloatArray:
        return self.hypothesis.to_values(self.coordinates)

    @property
    def measured(self) -> list[FloatArray]:
        """The measured outputs that the fit was made to, a record each."""
        return [e + s for e, s in zip(self.residuals, self.simulated, strict=True)]

    @property
    def rmse(self) -> float:
        """Plain root mean square of the residuals, output units."""
        return float(np.sqrt(np.mean(np.concatenate(self.residuals) ** 2)))

    def precision(self) -> FloatArray:
        """Gauss-Newton precision of the coordinates (parameters, parameters), prior included."""
        total = np.diag(1 / self.hypothesis.prior_sds**2)
        for record, jacobian in enumerate(self.jacobians):
            white = self.whitener.whiten(jacobian, record)
            total = total + white.T @ white
        return total

    def log_evidence(self) -> float:
        """Laplace approximation of the log of the marginal likelihood, noise parameters by their count."""
        deviation = (self.coordinates - self.hypothesis.prior_means) / self.hypothesis.prior_sds
        log_prior = -0.5 * float(deviation @ deviation) - float(np.sum(np.log(self.hypothesis.prior_sds)))
        _, log_determinant = np.linalg.slogdet(self.precision())
        samples = sum(len(e) for e in self.residuals)
        penalty = 0.5 * self.whitener.parameter_count * np.log(samples)
        return self.whitener.log_likelihood + log_prior - 0.5 * float(log_determinant) - float(penalty)


def evaluated(
    hypothesis: Hypothesis, measured: Sequence[FloatArray], at: FloatArray, whitener: Whitener
) -> Fit:
    """The hypothesis at coordinates `at` (parameters,), not fitted."""
    return fit(hypothesis, measured, at, whitener, 0)


def jacobians(
    hypothesis: Hypothesis, coordinates: FloatArray, simulated: Sequence[FloatArray]
) -> list[FloatArray]:
    """Derivatives (samples, parameters) of every record's output by forward differences."""
    steps = hypothesis.derivative_steps
    moved = hypothesis.simulate_batch(hypothesis.to_values(coordinates + np.diag(steps)))
    return [
        np.nan_to_num((y - at[:, None]) / steps, nan=0.0, posinf=0.0, neginf=0.0)
        for y, at in zip(moved, simulated, strict=True)
    ]


def fit(
    hypothesis: Hypothesis,
    measured: Sequence[FloatArray],
    start: FloatArray,
    whitener: Whitener,
    max_iterations: int = MAX_ITERATIONS,
    free: BoolArray | None = None,
) -> Fit:
    """The coordinates near `start` that minimise the whitened squared error and the priors' pull.

    Where `free` (parameters,) is given, the others stay at their start.
    """
    means, sds = hypothesis.prior_means, hypothesis.prior_sds

    def evaluate(
        coordinates: FloatArray,
    ) -> tuple[float, list[FloatArray], list[FloatArray], list[FloatArray]]:
        simulated = hypothesis.simulate(hypothesis.to_values(coordinates))
        residuals = [y - s for y, s in zip(measured, simulated, strict=True)]
        white = [whitener.whiten(e[:, None], record)[:, 0] for record, e in enumerate(residuals)]
        pull = (coordinates - means) / sds
        cost = 0.5 * (sum(float(e @ e) for e in white) + float(pull @ pull))
        return (cost if np.isfinite(cost) else np.inf), simulated, residuals, white

    coordinates = start.copy()
    cost, simulated, residuals, white = evaluate(coordinates)
    damping = 1e-3
    derivatives, exact = jacobians(hypothesis, coordinates, simulated), True
    for _ in range(max_iterations):
        precision, gradient = np.diag(1 / sds**2), (means - coordinates) / sds**2
        for record, jacobian in enumerate(derivatives):
            filtered = whitener.whiten(jacobian, record)
            precision = precision + filtered.T @ filtered
            gradient = gradient + filtered.T @ white[record]
        if free is not None:
            gradient = np.where(free, gradient, 0.0)
            precision = np.where(np.outer(free, free), precision, np.diag(np.diag(precision)))
        improved = False
        before, earlier, shown = cost, coordinates, simulated
        for _ in range(8):
            try:
                factor = cho_factor(precision + damping * np.diag(np.diag(precision)))
                step = cho_solve(factor, gradient)
            except (LinAlgError, ValueError):
                damping *= 10
                continue
            trial = np.clip(
                coordinates + np.clip(step, -2 * sds, 2 * sds), means - FARTHEST * sds, means + FARTHEST * sds
            )
            result = evaluate(trial)
            if result[0] < cost:
                coordinates, (cost, simulated, residuals, white) = trial, result
                damping = max(damping / 5, 1e-9)
                improved = True
                break
            damping *= 6
        if not improved and exact:
            break
        if not improved or before - cost < GOOD_ENOUGH * max(cost, 1.0):
            if exact:
                break
            derivatives, exact = jacobians(hypothesis, coordinates, simulated), True
        elif exact:
            derivatives, exact = _updated(derivatives, coordinates - earlier, simulated, shown), False
        else:
            derivatives, exact = jacobians(hypothesis, coordinates, simulated), True
    if not exact:
        derivatives = jacobians(hypothesis, coordinates, simulated)
    return Fit(hypothesis, coordinates, residuals, simulated, derivatives, whitener, cost)


def _updated(
    derivatives: Sequence[FloatArray],
    step: FloatArray,
    after: Sequence[FloatArray],
    before: Sequence[FloatArray],
) -> list[FloatArray]:
    """Broyden's update (doi 10.1090/S0025-5718-1965-0198670-6): derivatives that agree with the last step."""
    length = float(step @ step)
    return [
        jacobian + np.outer(y - earlier - jacobian @ step, step) / length
        for jacobian, y, earlier in zip(derivatives, after, before, strict=True)
    ]
