"""Profile likelihoods, to either side of the estimate, with the paths of the other parameters kept.

The profile of a parameter is the likelihood with all others re-estimated at each of its values (Raue et al.,
doi 10.1093/bioinformatics/btp358). No prior enters; every other parameter is held within BOUND prior standard
deviations of its prior's median, and a point where one of them stands at such a bound says so: the likelihood
may fall there because that parameter could not follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from scipy.optimize import least_squares

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.sensitivity import fisher_information
from bayes_hw.identify.output_error import DIFFERENCE_STEP, prior_scale, simulated_outputs, whitened
from bayes_hw.infer.starting_point import covariance_with_prior
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import as_coordinates, as_values
from bayes_hw.record import Record

Side: TypeAlias = Literal["falls", "falls at a bound", "open", "zero"]

THRESHOLD = 1.92
"""Fall of the log-likelihood that bounds a 95 % interval: half the 95 % quantile of chi squared with one
degree of freedom."""

DEEPEST = 4.0
"""A side is followed until the log-likelihood has fallen by this much."""

REACH = 3.0
"""... or until the parameter is this many prior standard deviations from its prior's median."""

BOUND = 6.0
AT_BOUND = 1e-3
PUSHING = 0.05
"""A parameter at its bound is held back by it when the log-likelihood would gain more than this a prior
standard deviation beyond; one that changes nothing may stand there as well as anywhere."""

PULL = 1e-3
POINTS_A_SIDE = 14
FIRST_STEP = 0.5
AIM = DEEPEST / 7
"""Fall of the log-likelihood that a step aims at."""

LARGEST_GROWTH = 2.0
MOST_REFINEMENTS = 8
EVALUATIONS = 25
CLEARLY_BETTER = 0.1
MOST_RESTARTS = 2


@dataclass(frozen=True, eq=False)
class Profile:
    """The profile log-likelihood of one parameter, in order of its value.

    `values` (points,), `log_likelihood` (points,) relative to the largest, `nuisance` (points, parameters)
    all parameters' values along the profile, `at_bound` for every point the names of those at a bound.
    `lower` and `upper` say what happens to either side: "falls" past THRESHOLD; "falls at a bound" does so
    only while another parameter is at its bound; "open" does not within REACH prior standard deviations of
    the prior's median; "zero" is the open lower side of a half width whose upper side falls: no dead zone is
    as likely.
    """

    name: str
    unit: str
    estimate: float
    values: FloatArray
    log_likelihood: FloatArray
    nuisance: FloatArray
    names: tuple[str, ...]
    at_bound: tuple[tuple[str, ...], ...]
    lower: Side
    upper: Side

    def fall(self, above: bool) -> float:
        """The largest fall of the log-likelihood on one side of the estimate."""
        beyond = self.values > self.estimate if above else self.values < self.estimate
        return abs(float(np.min(self.log_likelihood[beyond], initial=0.0)))

    def bound_partner(self, above: bool) -> str:
        """A parameter that stands at its bound on one side; empty where none does."""
        beyond = self.values > self.estimate if above else self.values < self.estimate
        return next(
            (names[0] for inside, names in zip(beyond, self.at_bound, strict=True) if inside and names), ""
        )

    def interval(self) -> tuple[float | None, float | None]:
        """Where the profile falls by THRESHOLD, by linear interpolation; None on a side where it does not."""
        below = self.values < self.estimate
        return (
            _crossing(self.values[below][::-1], self.log_likelihood[below][::-1], self.estimate),
            _crossing(self.values[~below], self.log_likelihood[~below], self.estimate),
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain data of identifiability.json."""
        low, high = self.interval()
        return {
            "unit": self.unit,
            "estimate": self.estimate,
            "lower_side": self.lower,
            "upper_side": self.upper,
            "interval95": [low, high],
            "values": self.values.tolist(),
            "log_likelihood": self.log_likelihood.tolist(),
            "nuisance": {name: self.nuisance[:, i].tolist() for i, name in enumerate(self.names)},
            "at_bound": [list(names) for names in self.at_bound],
        }


class Point(NamedTuple):
    """Coordinates (parameters,), the log-likelihood up to a constant, and the parameters that their bounds
    hold back there."""

    coordinates: FloatArray
    log_likelihood: float
    at_bound: tuple[str, ...]


class Misfit:
    """Half the whitened sum of squares as a least-squares problem in the coordinates that are not held."""

    def __init__(
        self,
        axis: AxisParameters,
        records: Sequence[Record],
        autoregression: FloatArray,
        innovation_sigma: float,
    ) -> None:
        self.axis, self.records = axis, records
        self.autoregression, self.innovation_sigma = autoregression, innovation_sigma
        self.median, self.prior_sd = prior_scale(axis)
        self.lowest = self.median - BOUND * self.prior_sd
        self.highest = self.median + BOUND * self.prior_sd

    def residuals(self, coordinates: FloatArray) -> FloatArray:
        """Whitened residuals (walkers, samples) of coordinates (parameters, walkers)."""
        values = as_values(self.axis.parameters, coordinates)
        outputs = simulated_outputs(self.axis, values, self.records)
        parts = [
            whitened(record.y - output, self.autoregression, record.measured) / self.innovation_sigma
            for record, output in zip(self.records, outputs, strict=True)
        ]
        return np.nan_to_num(np.concatenate(parts, axis=1), nan=1e6, posinf=1e6, neginf=-1e6)

    def minimised(self, start: FloatArray, held: int | None) -> Point:
        """The point with all but `held` re-estimated from `start`.

        A pull towards the start, far too weak to count, keeps parameters that change nothing in place.
        """
        free = [i for i in range(len(start)) if i != held]
        scale = self.prior_sd[free]

        def at(x: FloatArray) -> FloatArray:
            coordinates = np.repeat(start[:, None], x.shape[1], axis=1)
            coordinates[free] = x * scale[:, None]
            return coordinates

        def residual(x: FloatArray) -> FloatArray:
            return np.concatenate([self.residuals(at(x[:, None]))[0], PULL * (x - begin)])

        def jacobian(x: FloatArray) -> FloatArray:
            step = DIFFERENCE_STEP / scale
            trials = np.concatenate([x[:, None] + np.diag(step), x[:, None] - np.diag(step)], axis=1)
            rows = self.residuals(at(trials))
            slopes = ((rows[: len(x)] - rows[len(x) :]) / (2 * step[:, None])).T
            return np.concatenate([slopes, PULL * np.eye(len(x))])

        low, high = self.lowest[free] / scale, self.highest[free] / scale
        begin = np.clip(start[free] / scale, low + 1e-9, high - 1e-9)
        found = least_squares(
            residual, begin, jac=jacobian, bounds=(low, high), x_scale="jac", max_nfev=EVALUATIONS, ftol=1e-7
        )
        coordinates = start.copy()
        coordinates[free] = found.x * scale
        close = (found.x < low + AT_BOUND) | (found.x > high - AT_BOUND)
        pushed = close & (np.abs(found.grad) > PUSHING)
        names = tuple(self.axis.names[i] for i, held_back in zip(free, pushed, strict=True) if held_back)
        return Point(coordinates, self.log_likelihood(coordinates), names)

    def log_likelihood(self, coordinates: FloatArray) -> float:
        """Log-likelihood of one point (parameters,), up to a constant."""
        return -0.5 * float(np.sum(self.residuals(coordinates[:, None]) ** 2))

    def widths(self, coordinates: FloatArray) -> FloatArray:
        """Standard deviations (parameters,) that information and prior together give."""
        noise = self.autoregression[:, None], np.array([self.innovation_sigma])
        values = as_values(self.axis.parameters, coordinates[:, None])
        information = fisher_information(self.axis, values, self.records, *noise)[0]
        return np.sqrt(np.diag(covariance_with_prior(information, self.prior_sd)))


def profile_likelihoods(
    axis: AxisParameters,
    start: FloatArray,
    records: Sequence[Record],
    autoregression: FloatArray,
    innovation_sigma: float,
    names: Sequence[str] | None = None,
) -> tuple[Profile, ...]:
    """Profiles of the parameters `names` (of all but initial states when None).

    `start` (parameters,) are values near the estimate; the noise is held as given. A clearly better
    likelihood found on the way starts all profiles anew.
    """
    misfit = Misfit(axis, records, autoregression, innovation_sigma)
    chosen = [name for name in axis.names if not name.startswith("start")] if names is None else names
    best = misfit.minimised(as_coordinates(axis.parameters, start), None)
    for _ in range(1 + MOST_RESTARTS):
        widths = misfit.widths(best.coordinates)
        sides_of = {
            row: [_follow(misfit, best, row, side, FIRST_STEP * widths[row]) for side in (-1, 1)]
            for row in (axis.names.index(name) for name in chosen)
        }
        found = [point for sides in sides_of.values() for side in sides for point in side]
        better = max(found, key=lambda point: point.log_likelihood)
        if better.log_likelihood < best.log_likelihood + CLEARLY_BETTER:
            break
        best = misfit.minimised(better.coordinates, None)
    sides_of = {row: both_sides(misfit, best, row, sides) for row, sides in sides_of.items()}
    everywhere = [point.log_likelihood for sides in sides_of.values() for side in sides for point in side]
    top = max(best.log_likelihood, *everywhere)
    return tuple(_profile(axis, best, top, row, sides) for row, sides in sides_of.items())


def both_sides(misfit: Misfit, best: Point, row: int, sides: list[list[Point]]) -> list[list[Point]]:
    """The sides, and from `best` what a last restart has left without a point: nothing is known there yet."""
    empty = [side for side, points in zip((-1, 1), parted(sides, best, row), strict=True) if not points]
    if not empty:
        return sides
    step = FIRST_STEP * misfit.widths(best.coordinates)[row]
    return [*sides, *(_follow(misfit, best, row, side, step) for side in empty)]


def _follow(misfit: Misfit, best: Point, row: int, side: int, first_step: float) -> list[Point]:
    """Points outward from the estimate; the steps aim at equal falls of the log-likelihood."""
    origin, top = best.coordinates[row], best.log_likelihood
    end = max(side * (misfit.median[row] - origin) + REACH * misfit.prior_sd[row], misfit.prior_sd[row])
    step, distance, current = first_step, 0.0, best
    points: list[Point] = []
    refinements = 0
    while len(points) < POINTS_A_SIDE and distance < end * (1 - 1e-9):
        further = min(distance + step, end)
        trial = current.coordinates.copy()
        trial[row] = origin + side * further
        found = misfit.minimised(trial, row)
        fall = current.log_likelihood - found.log_likelihood
        deep = top - found.log_likelihood > DEEPEST
        if deep and fall > DEEPEST / 2 and refinements < MOST_REFINEMENTS:
            refinements += 1
            step = (further - distance) / 3
            continue
        points.append(found)
        if deep:
            break
        step *= LARGEST_GROWTH if fall <= 0 else float(np.clip(AIM / fall, 0.5, LARGEST_GROWTH))
        current, distance = found, further
    return points


def _profile(axis: AxisParameters, best: Point, top: float, row: int, sides: list[list[Point]]) -> Profile:
    parameter = axis.parameters[row]
    below, above = parted(sides, best, row)
    points = [*reversed(below), best, *above]
    coordinates = np.stack([point.coordinates for point in points], axis=1)
    nuisance = as_values(axis.parameters, coordinates).T
    level = np.array([point.log_likelihood for point in points]) - top
    held = [point.at_bound for point in points]
    towards = [_side(top, side) for side in (below, above)]
    estimate = float(nuisance[len(below), row])
    if towards[0] == "open" and towards[1] != "open" and "half_width" in parameter.name:
        towards[0] = "zero"
    if nuisance[0, row] > nuisance[-1, row]:
        nuisance, level, held, towards = nuisance[::-1], level[::-1], held[::-1], towards[::-1]
    return Profile(
        name=parameter.name,
        unit=parameter.unit,
        estimate=estimate,
        values=nuisance[:, row].copy(),
        log_likelihood=level,
        nuisance=nuisance,
        names=axis.names,
        at_bound=tuple(held),
        lower=towards[0],
        upper=towards[1],
    )


def parted(sides: Sequence[Sequence[Point]], best: Point, row: int) -> tuple[list[Point], list[Point]]:
    """The points below and above `best` in coordinate `row`, each outward from it.

    They were followed from an estimate that a last restart may have left behind.
    """
    ordered = sorted((point for side in sides for point in side), key=lambda point: point.coordinates[row])
    at = best.coordinates[row]
    below = [point for point in ordered if point.coordinates[row] < at]
    return below[::-1], [point for point in ordered if point.coordinates[row] > at]


def _side(top: float, points: list[Point]) -> Side:
    for point in points:
        if top - point.log_likelihood > THRESHOLD:
            return "falls at a bound" if point.at_bound else "falls"
    return "open"


def _crossing(values: FloatArray, level: FloatArray, estimate: float) -> float | None:
    """Where `level` (points,), outward from the estimate, first reaches -THRESHOLD."""
    inner_value, inner_level = estimate, 0.0
    for value, reached in zip(values.tolist(), level.tolist(), strict=True):
        if reached <= -THRESHOLD:
            share = (inner_level + THRESHOLD) / (inner_level - reached)
            return inner_value + share * (value - inner_value)
        inner_value, inner_level = value, reached
    return None
