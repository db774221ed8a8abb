"""Order, delay and integrator of G, chosen on the whole cascade with its noise.

Every larger cascade starts as a smaller one with a pole or pair of zero weight, so that no order fits worse
than the one before it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.crew import each
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_basis import linear_basis, with_linear_solution
from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.descent import Point, descend, evaluate
from bayes_hw.identify.growth.extension import (
    repaired,
    with_real_pole,
    with_section,
    without_real_pole,
    without_section,
)
from bayes_hw.identify.growth.levels import level_shapes
from bayes_hw.identify.growth.lowered import clipped, commands
from bayes_hw.identify.growth.score_test import Candidate, best_candidates
from bayes_hw.identify.noise import MAX_ORDER
from bayes_hw.record import Record
from bayes_hw.time_budget import time_is_up

SHARES = np.linspace(0.15, 0.95, 9)
"""Of the outermost place of a limit: where it is begun."""

AT_OUTERMOST = 0.999
"""Share of the outermost place from which a limit stands there."""

MOST_ROWS = 4000
"""Samples, evenly taken, that weights are sought on."""


def with_limits_anew(response: CascadeResponse, values: CascadeValues) -> CascadeValues | None:
    """`values` with every limit that stands at its outermost place at the one of SHARES that explains most,
    the weights of G by least squares; None where no limit stands there."""
    structure, (lower, upper) = response.structure, response.outermost_limits
    lowers = SHARES * lower if structure.lower and values.lower < AT_OUTERMOST * lower else [values.lower]
    uppers = SHARES * upper if structure.upper and values.upper > AT_OUTERMOST * upper else [values.upper]
    if len(lowers) == len(uppers) == 1:
        return None
    trials = [replace(values, lower=float(below), upper=float(above)) for below in lowers for above in uppers]
    solved = [with_least_squares(structure, trial, response.records) for trial in trials]
    return min(solved, key=lambda pair: pair[0])[1]


def with_least_squares(
    structure: Structure, values: CascadeValues, records: Sequence[Record], clear: float = 0.0
) -> tuple[float, CascadeValues]:
    """What the weights of G (and initial states, and free levels) that explain most leave, a mean square of
    the samples outside the dead zone, further from zero than `clear`; and `values` with them."""
    limited = [clipped(commands(record), values.lower, values.upper) for record in records]
    shapes = level_shapes(records)
    columns, targets = [], []
    for number, (basis, record) in enumerate(
        zip(linear_basis(structure, values, limited), records, strict=True)
    ):
        levels = np.zeros((len(records), len(record)))
        levels[number] = shapes[number]
        outside = record.measured_samples & (np.abs(record.y) > clear)
        columns.append(np.concatenate([basis, levels])[:, outside])
        targets.append((record.y + values.half_width * np.sign(record.y))[outside])
    target = np.concatenate(targets)
    every = max(1, len(target) // MOST_ROWS)
    matrix, target = np.concatenate(columns, axis=1)[:, ::every].T, target[::every]
    solution = np.linalg.lstsq(matrix, target, rcond=None)[0]
    left = float(np.mean((target - matrix @ solution) ** 2))
    return left, with_linear_solution(structure, values, solution[: len(solution) - len(records)])


LIMIT_GRID = 12
SMALLEST_LIMIT = 0.1
"""Of the largest command on a side: where the grid of limits begins."""

HALF_WIDTHS = (0.5, 3.0, 15.0)
"""Half widths that descents start from, in standard deviations of the output's white part."""

CANDIDATES = 3
ROUNDS = ((4, 3), (10, 2))
"""Successive halving: steps given to every candidate, and how many go on."""

LAST_STEPS = 60
ABSORBED = 3.0
"""Residuals so many times as large as their innovations may hide a misfit."""

LEAST_ORDER, PATIENCE = 6, 2
"""The growth ends at an order of at least the first when the criterion has not improved for more orders than
the second."""


@dataclass(frozen=True, eq=False)
class Grown:
    """One fitted structure of the search; `plain` is what it grew as where that was on plain residuals."""

    response: CascadeResponse
    point: Point
    plain: Grown | None = None

    @property
    def structure(self) -> Structure:
        return self.response.structure

    @property
    def values(self) -> CascadeValues:
        return self.response.values(self.point.coordinates)

    @property
    def log_likelihood(self) -> float:
        return self.point.log_likelihood

    @property
    def parameters(self) -> int:
        """Coordinates and those of the noise."""
        return len(self.point.coordinates) + self.point.whitener.order + 1

    @property
    def longest(self) -> int:
        """Samples of the longest record."""
        return max(len(record) for record in self.response.records)

    @property
    def criterion(self) -> float:
        """Bayesian information criterion (Schwarz 1978, doi 10.1214/aos/1176344136), smaller is better.

        What is known of an initial state does not grow with the record: such a one costs what noise alone
        gains by it (Akaike 1974, doi 10.1109/TAC.1974.1100705).
        """
        states = len(self.response.records) * self.structure.order if self.structure.free_start else 0
        lasting = self.parameters - states
        return -2 * self.log_likelihood + lasting * float(np.log(self.point.samples)) + 2 * states

    @classmethod
    def at(
        cls,
        structure: Structure,
        values: CascadeValues,
        records: Sequence[Record],
        most_noise: int = MAX_ORDER,
    ) -> Grown:
        """At given values, without any descent."""
        response = CascadeResponse(structure, records)
        return cls(response, evaluate(response, response.coordinates(values), most_noise=most_noise))

    def under_noise(self, most_noise: int) -> Grown:
        """The same cascade with noise of orders up to `most_noise`."""
        return Grown.at(self.structure, self.values, self.response.records, most_noise)

    @cached_property
    def on_plain_residuals(self) -> Grown:
        """The likelier of what it grew as on plain residuals and a descent on those from where it is."""
        descended = self.under_noise(0).descended()
        return descended if self.plain is None else likeliest([descended, self.plain])

    def descended(self, steps: int = LAST_STEPS) -> Grown:
        """After at most `steps` steps."""
        if self.point.converged:
            return self
        return replace(self, point=descend(self.response, self.point, steps))


def likeliest(items: Sequence[Grown]) -> Grown:
    """The one of the largest log-likelihood."""
    return max(items, key=lambda item: item.log_likelihood)


def halved(items: Sequence[Grown]) -> Grown:
    """The best of several starts by successive halving (doi 10.48550/arXiv.1502.07943)."""
    remaining = list(items)
    for steps, kept in ROUNDS:
        if len(remaining) <= 1:
            break
        further = each(lambda item: item.descended(steps), remaining)  # noqa: B023
        remaining = sorted(further, key=lambda g: -g.log_likelihood)[:kept]
    return likeliest(each(lambda item: item.descended(), remaining))


def smallest_cascade(
    records: Sequence[Record], structure: Structure, noise_level: float, most_noise: int = MAX_ORDER
) -> Grown:
    """An integrator with limits and dead zone: limits by a grid, gain by least squares, then descents."""
    given = np.concatenate([record.u for record in records])
    shares = np.linspace(SMALLEST_LIMIT, 1.0, LIMIT_GRID)
    lowers = float(given.min()) * shares if structure.lower else [-np.inf]
    uppers = float(given.max()) * shares if structure.upper else [np.inf]
    grid = [
        _integrated(records, structure, float(lower), float(upper)) for lower in lowers for upper in uppers
    ]
    _, lower, upper, gain = min(grid)
    trials = []
    for half_width in HALF_WIDTHS if structure.dead_zone else (0.0,):
        values = CascadeValues(
            lower, upper, half_width * noise_level, 0.0, gain,
            np.zeros((2, 0)), np.zeros((4, 0)), np.zeros((len(records), 1)),
        )  # fmt: skip
        trials.append(Grown.at(structure, values, records, most_noise))
    return halved(trials)


def _integrated(
    records: Sequence[Record], structure: Structure, lower: float, upper: float
) -> tuple[float, float, float, float]:
    """Sum of squares that the integral of the clipped command leaves, with limits and gain."""
    cross = power = 0.0
    parts: list[tuple[FloatArray, FloatArray]] = []
    for record in records:
        v = clipped(commands(record), lower, upper)
        w = np.concatenate([np.zeros(structure.delay_samples + 1), np.cumsum(v)])[: len(v)]
        y = record.y
        if structure.free_start:
            w, y = w - w.mean(), y - y.mean()
        parts.append((w, y))
        cross += float(w @ y)
        power += float(w @ w)
    gain = cross / power if power > 0 else 0.0
    return sum(float(np.sum((y - gain * w) ** 2)) for w, y in parts), lower, upper, gain


def grow(
    start: Grown,
    largest_order: int,
    progress: Callable[[int], None] | None = None,
    least_order: int = LEAST_ORDER,
) -> dict[int, Grown]:
    """The best cascade of every order from that of `start` on, as far as the criterion asks and time allows.

    The noise is of the orders that `start` allows while the cascade grows, of any order where it is judged.
    """
    most_noise = start.point.most_noise
    pool = {start.structure.order: start}
    judged: dict[int, Grown] = {}
    order = start.structure.order
    while order < largest_order and not time_is_up():
        if progress is not None:
            progress(order)
        current = pool[order]
        real, pairs = best_candidates(current.response, current.point, CANDIDATES)
        _keep(pool, halved([extended(current, candidate) for candidate in real]))
        if order + 2 <= largest_order:
            _keep(pool, halved([extended(current, candidate) for candidate in pairs]))
        order += 1
        if most_noise == MAX_ORDER:
            judged = pool
        else:
            judged[order] = replace(pool[order].under_noise(MAX_ORDER).descended(), plain=pool[order])
        best_order = min(judged, key=lambda n: judged[n].criterion)
        if order >= least_order and order > best_order + PATIENCE:
            break
    return judged or pool


def with_smaller_ones(pool: dict[int, Grown]) -> dict[int, Grown]:
    """Every order also from those above it, with each of their parts left out: what grew first may stand
    where larger cascades have found better."""
    for order in sorted(pool, reverse=True):
        smaller = without_each_part(pool[order])
        for size in {item.structure.order for item in smaller} & set(pool):
            _keep(pool, halved([item for item in smaller if item.structure.order == size]))
    return pool


def without_each_part(item: Grown) -> list[Grown]:
    """`item` without one of its real poles or sections, for each of them, without any descent."""
    structure, values = item.structure, item.values
    fewer = [without_real_pole(structure, values, i) for i in range(structure.real_poles)]
    fewer += [without_section(structure, values, i) for i in range(structure.sections)]
    records, most_noise = item.response.records, item.point.most_noise
    return [Grown.at(*one, records, most_noise) for one in fewer]


def extended(current: Grown, candidate: Candidate) -> Grown:
    """`current` with the candidate at zero weight."""
    if candidate.a2 is None:
        structure, values = with_real_pole(current.structure, current.values, candidate.a1)
    else:
        structure, values = with_section(current.structure, current.values, candidate.a1, candidate.a2)
    response = CascadeResponse(structure, current.response.records)
    at, point = response.coordinates(values), current.point
    return Grown(response, evaluate(response, at, point.whitener, point.most_noise))


def absorbed(item: Grown) -> bool:
    """Whether the noise model may have taken up what a cascade could explain.

    An autoregression whitens a large slow misfit away, and the likelihood hardly sees it any more: its
    residuals are then far larger than its innovations.
    """
    point = item.point
    innovations = np.sqrt(point.sum_of_squares / point.samples)
    return bool(point.rms > ABSORBED * innovations)


def _keep(pool: dict[int, Grown], found: Grown) -> None:
    found = _at_least(found, repaired(found.structure, found.values))
    found = _at_least(found, with_limits_anew(found.response, found.values))
    order = found.structure.order
    if order not in pool or pool[order].log_likelihood < found.log_likelihood:
        pool[order] = found


def _at_least(item: Grown, values: CascadeValues | None) -> Grown:
    """`item`, or what a descent from other values of it finds where that is likelier."""
    if values is None:
        return item
    again = Grown.at(item.structure, values, item.response.records, item.point.most_noise)
    return likeliest([item, again.descended()])


def beyond_all_commands(item: Grown) -> Grown:
    """`item`, or the same begun with its limits at their outermost places, the weights of G by least squares,
    where that is likelier. Limits that clip what no limit did leave steps in the angle for good: noise of
    high order takes them up, and a descent under it may leave the limits where they are."""
    structure, values, (lower, upper) = item.structure, item.values, item.response.outermost_limits
    outermost = replace(
        values,
        lower=lower if structure.lower else values.lower,
        upper=upper if structure.upper else values.upper,
    )
    inside = values.lower > AT_OUTERMOST * outermost.lower or values.upper < AT_OUTERMOST * outermost.upper
    return _at_least(
        item, with_least_squares(structure, outermost, item.response.records)[1] if inside else None
    )
