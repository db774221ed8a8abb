"""Slow real poles that the evidence cannot exclude.

Each reversal of a velocity whose gain settles slowly loses a fixed travel, as a dead zone does: to first
order the two cannot be told apart. A criterion that drops slow poles for want of evidence would hand their
travel to the dead zone, with a narrow interval. So a cascade with a dead zone keeps two slow real poles even
where the criterion asks for none; they are real, since a pair would turn into an oscillation and fit noise. A
slow oscillation that the search has found in their place is weighed against them.

Poles that stand in for the integrator: so slow that no record tells them from it.

Within a record such a pole answers as the integrator does, so that only the sum of both weights is told, and
their difference is a steady velocity long after any record ends: a gain that nothing has measured.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_roots import poles_of, section_poles
from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.descent import evaluate
from bayes_hw.identify.growth.extension import with_parted_section, with_separate_pole, without_section
from bayes_hw.identify.growth.held_poles import fitted_with_held_poles
from bayes_hw.identify.growth.score_test import Residual
from bayes_hw.identify.growth.search import Grown, halved
from bayes_hw.identify.structure_choice import chosen

RECORDS_LONG = 10
"""Time constants of as many of the longest record and more are the integrator's."""


def stands_in(poles: FloatArray, longest: int) -> BoolArray:
    """Which of real `poles` (n,) decay by less than 1 / e within RECORDS_LONG of the longest record."""
    return np.asarray(poles > np.exp(-1 / (RECORDS_LONG * longest)))


def with_one_integrator(item: Grown) -> Grown:
    """`item`, which has an integrator, with poles that stand in for it one with it, where the criterion asks
    for that."""
    structure, values = joined_to_integrator(item.structure, item.values, item.longest)
    if structure is item.structure:
        return item
    again = Grown.at(structure, values, item.response.records, item.point.most_noise).descended()
    return with_one_integrator(again) if again.criterion < item.criterion else item


def joined_to_integrator(
    structure: Structure, values: CascadeValues, longest: int
) -> tuple[Structure, CascadeValues]:
    """The same response over `longest` samples from poles that do not stand in for the integrator;
    `structure` itself where none does, or where there is no integrator."""
    if not structure.integrator:
        return structure, values
    for number in reversed(range(structure.sections)):
        poles = section_poles(*values.sections[:2, number])
        if np.all(poles.imag == 0) and stands_in(poles.real, longest).any():
            structure, values = with_parted_section(structure, values, number)
    kept = ~stands_in(values.real[0], longest)
    if kept.all():
        return structure, values
    at = 1 + np.arange(structure.real_poles)
    starts = np.delete(values.starts, at[~kept], axis=1)
    starts[:, 0] += values.starts[:, at[~kept]].sum(axis=1)
    residue = values.integrator_residue + float(values.real[1, ~kept].sum())
    smaller = replace(structure, real_poles=int(kept.sum()))
    return smaller, replace(values, integrator_residue=residue, real=values.real[:, kept], starts=starts)


SLOW_POLES = 2
SLOWEST_SHARE = 0.1
"""Of the longest record: the longest time constant looked for."""

FASTEST_SHARE, FEWEST_SAMPLES = 1 / 250, 10
"""A pole is slow from this share of the longest record on, and from as many samples."""

STRONG_DAMPING, APART = 0.5, 0.3
"""Damping ratio from which a pair may be two real poles, and how far these start from its modulus."""

SEAM_NATS = 1.0
"""Log-likelihood that two real poles may cost."""

TIME_CONSTANTS = 9
DESCENTS = 3


def slow_time_constants(item: Grown) -> tuple[float, float]:
    """The shortest and longest time constant, in samples, that count as slow."""
    return max(FEWEST_SAMPLES, FASTEST_SHARE * item.longest), SLOWEST_SHARE * item.longest


def slow_poles(item: Grown) -> int:
    """How many poles of G are slow, whatever their damping, besides the integrator and what stands in for
    it."""
    poles = poles_of(item.values, integrator=False)
    poles = poles[(poles.imag != 0) | ~stands_in(poles.real, item.longest)]
    shortest, _ = slow_time_constants(item)
    modulus = np.clip(np.abs(poles), 1e-12, 1.0)
    continuous = np.hypot(np.log(modulus), np.angle(poles))
    return int(np.count_nonzero(continuous < 1 / shortest))


def with_slow_poles(item: Grown, misfit: bool = False) -> Grown:
    """`item` with no fewer than SLOW_POLES slow poles, where it has an integrator.

    Where a slow oscillation stands for two of them, two real ones are put in its place if the criterion of
    the choice (`structure_choice`, with its `misfit`) asks less for what they fit; where there are fewer, two
    real ones are added.
    """
    shortest, longest = slow_time_constants(item)
    if longest <= shortest or not item.structure.integrator:
        return item
    for number in reversed(_slow_oscillations(item)):
        structure, values = without_section(item.structure, item.values, number)
        rest = Grown.at(structure, values, item.response.records, item.point.most_noise).descended()
        item = chosen([item, _with_two_more(rest)], misfit)
    return item if slow_poles(item) >= SLOW_POLES else _with_two_more(item)


def _slow_oscillations(item: Grown) -> list[int]:
    """Numbers of the sections whose poles are a slow pair."""
    shortest, _ = slow_time_constants(item)
    pairs = [section_poles(a1, a2)[0] for a1, a2 in item.values.sections[:2].T]
    return [i for i, pole in enumerate(pairs) if pole.imag and abs(np.log(pole)) < 1 / shortest]


def _with_two_more(item: Grown) -> Grown:
    """`item` with SLOW_POLES slow real ones more.

    Where a descent takes them to places that are not slow, or so slow that they stand in for the integrator,
    they stay where the score test has them, unless the records pay for them where they are.
    """
    shortest, longest = slow_time_constants(item)
    grid = np.exp(-1 / np.geomspace(shortest, longest, TIME_CONSTANTS))
    residual = Residual.of(item.response, item.point)
    pairs = list(combinations(range(TIME_CONSTANTS), 2))
    gains = residual.group_gains(grid, pairs)
    best = np.argsort(-gains)[:DESCENTS]
    starts = [_extended(item, grid[list(pairs[i])]) for i in best]
    found = halved([_at(item, *start) for start in starts])
    added = found.values.real[0, -SLOW_POLES:]
    inside = (added > np.exp(-1 / shortest)) & (added < np.exp(-1 / longest))
    paid = found.criterion < item.criterion and slow_poles(found) >= SLOW_POLES
    return found if paid or np.all(inside) else fitted_with_held_poles(*starts[0], item)


def _extended(item: Grown, poles: FloatArray) -> tuple[Structure, CascadeValues]:
    structure, values = item.structure, item.values
    for pole in poles:
        structure, values = with_separate_pole(structure, values, float(pole))
    return structure, values


def _at(item: Grown, structure: Structure, values: CascadeValues) -> Grown:
    response = CascadeResponse(structure, item.response.records)
    point = evaluate(response, response.coordinates(values), item.point.whitener, item.point.most_noise)
    return Grown(response, point)


def with_real_poles(item: Grown) -> Grown:
    """`item` with strongly damped pairs replaced by two real poles each, where that costs next to nothing.

    A posterior that straddles the border between a pair and two real poles has a seam there, which samplers
    cross badly.
    """
    number = 0
    while number < item.structure.sections:
        a1, a2, b1, b2 = item.values.sections[:, number]
        if a1 * a1 / 4 < a2 and _damping_ratio(a1, a2) > STRONG_DAMPING:
            logarithm = 0.5 * np.log(a2)
            poles = np.exp(logarithm * np.array([1 - APART, 1 + APART]))
            structure, values = without_section(item.structure, item.values, number)
            residues = np.linalg.solve(np.array([[1.0, 1.0], [-poles[1], -poles[0]]]), [b1, b2])
            for pole, residue in zip(poles, residues, strict=True):
                structure, values = with_separate_pole(structure, values, float(pole), residue)
            split = Grown.at(structure, values, item.response.records, item.point.most_noise).descended()
            if split.log_likelihood > item.log_likelihood - SEAM_NATS:
                item = split
                continue
        number += 1
    return item


def _damping_ratio(a1: float, a2: float) -> float:
    pole = np.log(complex(a1 / 2, np.sqrt(a2 - a1 * a1 / 4)))
    return float(-pole.real / abs(pole))
