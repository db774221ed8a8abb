"""Least squares of one hypothesis: Levenberg-Marquardt on whitened residuals with the priors' pull."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dposv

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.fit.fit_kernel import agreeing, forward_differences, normal_equations
from bayes_hw.gap.fit.free_level import level_of, without_level
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.fit.least_trimmed_squares import best_stretches
from bayes_hw.gap.noise.whitener import Plain, Whitener, bridge, readings_of
from bayes_hw.gap.simulate.builder import SignalChain
from bayes_hw.gap.simulate.columns import column, misses, only_where, square_sums

MAX_ITERATIONS = 25
GOOD_ENOUGH = 1e-5
"""Relative decrease of the cost at which the iteration ends."""

TRIES = (1, 3, 4)
"""Steps of growing damping that are simulated at once: mostly the first is good, or many fail."""

FARTHEST = 8.0
"""Prior standard deviations that a coordinate may move from the prior mean."""


@dataclass(frozen=True)
class Fit:
    """A hypothesis at its best coordinates.

    `residuals` are measured minus simulated outputs, a record each, where nothing was measured those between
    the neighbours; `jacobians` (samples, parameters) the
    derivatives of the simulated outputs; `cost` half the sum of squares of whitened residuals and priors.
    What a free level explains of the residuals is not part of them.
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
    def scale(self) -> AxisScale:
        """Sizes of the axis and its records."""
        return self.hypothesis.scale

    def chain(self) -> SignalChain:
        """The linear block at the estimate."""
        return self.hypothesis.chain(self.values)

    def motion(self) -> tuple[list[FloatArray], float]:
        """w (samples,) of every record, and the half width of the dead zone: `Hypothesis.motion`."""
        return self.hypothesis.motion(self.values)

    def with_residuals(self, residuals: list[FloatArray]) -> Fit:
        """The same with other residuals (samples,), a record each."""
        return replace(self, residuals=residuals)

    @property
    def unread(self) -> tuple[BoolArray, ...] | None:
        """Which samples were not measured, a mask a record; None where all were."""
        return self.hypothesis.unread

    @property
    def readings(self) -> int:
        """Samples that were measured."""
        return readings_of(self.residuals, self.unread)

    @property
    def measured(self) -> list[FloatArray]:
        """The measured outputs that the fit was made to, a record each."""
        return [e + s for e, s in zip(self.residuals, self.simulated, strict=True)]

    @cached_property
    def free_residuals(self) -> list[FloatArray]:
        """Measured minus simulated outputs (samples,), a record each, the simulation not corrected."""
        if self.hypothesis.followed is None:
            return self.residuals
        free = replace(self.hypothesis, followed=None).simulate(self.values)
        return [y - s for y, s in zip(self.measured, free, strict=True)]

    @property
    def rmse(self) -> float:
        """Plain root mean square of the residuals, output units."""
        return float(np.sqrt(np.mean(np.concatenate(self.residuals) ** 2)))

    def precision(self) -> FloatArray:
        """Gauss-Newton precision of the coordinates (parameters, parameters), prior included."""
        return self._quadratic[0]

    def descent(self) -> FloatArray:
        """Negative gradient of the cost (parameters,): zero at the minimum under its own noise."""
        return self._quadratic[1]

    def promised_cost(self) -> float:
        """The cost at the minimum of its own quadratic model: lower where the fit has far to go."""
        precision, gradient = self._quadratic
        step = _damped_step(precision, gradient, 0.0)
        return self.cost if step is None else self.cost - 0.5 * float(gradient @ step)

    @cached_property
    def _quadratic(self) -> tuple[FloatArray, FloatArray]:
        white = [self.whitener.whiten(e[:, None], record)[:, 0] for record, e in enumerate(self.residuals)]
        return _quadratic(self.hypothesis, self.coordinates, self.whitener, self.jacobians, white)

    def covariance(self) -> FloatArray:
        """Inverse of the precision, symmetric to the bit."""
        inverse = np.linalg.inv(self.precision())
        return np.asarray(0.5 * (inverse + inverse.T))

    @property
    def ran_away(self) -> bool:
        """Whether the response grows without bound at these parameters or beside them."""
        return not np.isfinite(self.precision()).all()

    def log_evidence(self) -> float:
        """Laplace approximation of the log of the marginal likelihood, noise parameters by their count.

        Minus infinity for a fit that has run away.
        """
        if self.ran_away:
            return -np.inf
        deviation = self.hypothesis.prior_deviations(self.coordinates)
        log_prior = -0.5 * float(deviation @ deviation) - float(np.sum(np.log(self.hypothesis.prior_sds)))
        _, log_determinant = np.linalg.slogdet(self.precision())
        samples = self.readings
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
    return [forward_differences(y, at, steps) for y, at in zip(moved, simulated, strict=True)]


def fit(
    hypothesis: Hypothesis,
    measured: Sequence[FloatArray],
    start: FloatArray,
    whitener: Whitener,
    max_iterations: int = MAX_ITERATIONS,
    free: BoolArray | None = None,
    left_out: float = 0.0,
) -> Fit:
    """The coordinates near `start` that minimise the whitened squared error and the priors' pull.

    Where `free` (parameters,) is given, the others stay at their start. The share `left_out` of the records'
    stretches, those that fit worst, does not count, nor in the cost.
    """
    task = _Task(hypothesis, measured, whitener, left_out)
    at = task.simulated(start[None]).point(0)
    return _descended(task, at, jacobians(hypothesis, at.coordinates, at.simulated), max_iterations, free)


def fitted_on(
    begun: Fit,
    measured: Sequence[FloatArray],
    whitener: Whitener,
    max_iterations: int = MAX_ITERATIONS,
    left_out: float = 0.0,
) -> Fit:
    """`fit` from where another ended, whose simulation and derivatives are not made again."""
    task = _Task(begun.hypothesis, measured, whitener, left_out)
    at = task.judged(begun.coordinates[None], [s[:, None] for s in begun.simulated]).point(0)
    return _descended(task, at, begun.jacobians, max_iterations)


class _Point(NamedTuple):
    """Coordinates with their cost, and simulated outputs and whitened residuals (samples,) a record, these
    zero where the samples are not `kept`."""

    coordinates: FloatArray
    cost: float
    simulated: list[FloatArray]
    white: list[FloatArray]
    kept: list[BoolArray] | None


class _Trials(NamedTuple):
    """The same for points (n, parameters): costs (n,), infinite where not finite, and columns of records."""

    points: FloatArray
    costs: FloatArray
    simulated: Sequence[FloatArray]
    white: Sequence[FloatArray]
    kept: Sequence[BoolArray] | None

    def point(self, i: int) -> _Point:
        """The i-th of the points."""
        return _Point(
            self.points[i],
            float(self.costs[i]),
            [column(s, i) for s in self.simulated],
            [column(e, i) for e in self.white],
            None if self.kept is None else [column(k, i) for k in self.kept],
        )


@dataclass(frozen=True)
class _Task:
    """What is fitted to which records under what noise; the share `left_out` of their stretches not."""

    hypothesis: Hypothesis
    measured: Sequence[FloatArray]
    whitener: Whitener
    left_out: float = 0.0

    def simulated(self, points: FloatArray) -> _Trials:
        """Every one of `points` (n, parameters) simulated."""
        return self.judged(points, self.hypothesis.simulate_batch(self.hypothesis.to_values(points)))

    def judged(self, points: FloatArray, simulated: Sequence[FloatArray]) -> _Trials:
        """`points` (n, parameters) with their outputs `simulated` (samples, n), a record each."""
        pulls = -self.hypothesis.log_prior(points)
        white = [
            without_level(self.hypothesis, self.whitener, self.whitener.whiten(misses(y, s), record), record)
            for record, (y, s) in enumerate(zip(self.measured, simulated, strict=True))
        ]
        costs = pulls + 0.5 * sum(square_sums(e) for e in white)
        kept = best_stretches(white, self.left_out) if self.left_out else None
        if kept is not None:
            white = [only_where(e, k) for k, e in zip(kept, white, strict=True)]
            trimmed = pulls + 0.5 * sum(square_sums(e) for e in white)
            costs = np.where(np.isfinite(costs), trimmed, np.inf)
        return _Trials(points, np.where(np.isfinite(costs), costs, np.inf), simulated, white, kept)

    def quadratic(self, at: _Point, derivatives: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
        """The cost about a point; see `_quadratic`."""
        return _quadratic(self.hypothesis, at.coordinates, self.whitener, derivatives, at.white, at.kept)


def _quadratic(
    hypothesis: Hypothesis,
    coordinates: FloatArray,
    whitener: Whitener,
    derivatives: Sequence[FloatArray],
    white: Sequence[FloatArray],
    kept: Sequence[BoolArray] | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton precision (parameters, parameters) and the cost's negative gradient (parameters,).

    `white` are the whitened residuals (samples,), zero where a sample is not `kept`.
    """
    prior = hypothesis.prior_jacobian(coordinates)
    precision = prior.T @ prior
    gradient = -prior.T @ hypothesis.prior_deviations(coordinates)
    for record, jacobian in enumerate(derivatives):
        filtered = without_level(hypothesis, whitener, whitener.whiten(jacobian, record), record)
        if kept is not None:
            filtered = only_where(filtered, kept[record][:, None])
        curvature, slope = normal_equations(filtered, white[record])
        precision = precision + curvature
        gradient = gradient + slope
    return precision, gradient


def _descended(
    task: _Task,
    at: _Point,
    derivatives: list[FloatArray],
    max_iterations: int,
    free: BoolArray | None = None,
) -> Fit:
    """The fit from `at`, where the outputs have the given `derivatives`."""
    hypothesis, exact = task.hypothesis, True
    means, sds = hypothesis.prior_means, hypothesis.prior_sds
    damping = 1e-3
    for _ in range(max_iterations):
        precision, gradient = task.quadratic(at, derivatives)
        if free is not None:
            gradient = np.where(free, gradient, 0.0)
            precision = np.where(np.outer(free, free), precision, np.diag(np.diag(precision)))
        improved = False
        before = at
        for tries in TRIES:
            dampings, steps = [], []
            for _ in range(tries):
                step = _damped_step(precision, gradient, damping)
                if step is None:
                    damping *= 10
                    continue
                dampings.append(damping)
                steps.append(np.clip(step, -2 * sds, 2 * sds))
                damping *= 6
            if not steps:
                continue
            trials = np.clip(at.coordinates + np.array(steps), means - FARTHEST * sds, means + FARTHEST * sds)
            found = task.simulated(trials)
            better = np.flatnonzero(found.costs < at.cost).tolist()
            if better:
                at, damping = found.point(better[0]), max(dampings[better[0]] / 5, 1e-9)
                improved = True
                break
        if not improved and exact:
            break
        if not improved or before.cost - at.cost < GOOD_ENOUGH * max(at.cost, 1.0):
            if exact:
                break
            derivatives, exact = jacobians(hypothesis, at.coordinates, at.simulated), True
        elif exact:
            step = at.coordinates - before.coordinates
            outputs = zip(derivatives, at.simulated, before.simulated, strict=True)
            derivatives, exact = [agreeing(slopes, step, *moved) for slopes, *moved in outputs], False
        else:
            derivatives, exact = jacobians(hypothesis, at.coordinates, at.simulated), True
    if not exact:
        derivatives = jacobians(hypothesis, at.coordinates, at.simulated)
    columns = [misses(y, s[:, None]) for y, s in zip(task.measured, at.simulated, strict=True)]
    if hypothesis.unread is not None:
        columns = [bridge(e, mask) for e, mask in zip(columns, hypothesis.unread, strict=True)]
    errors = [e[:, 0] for e in columns]
    residuals = [e - level_of(hypothesis, task.whitener, e, record) for record, e in enumerate(errors)]
    return Fit(hypothesis, at.coordinates, residuals, at.simulated, derivatives, task.whitener, at.cost)


def _damped_step(precision: FloatArray, gradient: FloatArray, damping: float) -> FloatArray | None:
    """The step of Levenberg and Marquardt, or None where the damped precision is not positive definite."""
    damped = precision.copy()
    damped.ravel()[:: len(damped) + 1] *= 1 + damping
    if not (np.isfinite(damped).all() and np.isfinite(gradient).all()):
        return None
    _, step, failed = dposv(damped, gradient)
    return None if failed else np.asarray(step)


NOISE_SHARE = 1 / 3
"""Of what the base model leaves: the noise assumed to start with."""

ROUNDS = 4


def plain_fit(start: Fit, measured: Sequence[FloatArray]) -> Fit:
    """Plain least squares from `start`, the noise taken to be what is left."""
    current = start
    for _ in range(ROUNDS):
        noise = Plain(current.rmse, masked=current.unread or ())
        current = fit(current.hypothesis, measured, current.coordinates, noise)
    return current


def first_sigma(base: Hypothesis, measured: Sequence[FloatArray]) -> float:
    """A noise to start with, output units, where none is given."""
    rough = Plain(float(np.std(np.concatenate(list(measured)))), masked=base.unread or ())
    return NOISE_SHARE * plain_fit(fit(base, measured, base.prior_means, rough), measured).rmse
