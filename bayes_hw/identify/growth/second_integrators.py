"""Poles that stand in for the integrator: so slow that no record tells them from it.

Within a record such a pole answers as the integrator does, so that only the sum of both weights is told, and
their difference is a steady velocity long after any record ends: a gain that nothing has measured.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_roots import section_poles
from bayes_hw.identify.growth.extension import fractions_of, with_separate_pole, without_section
from bayes_hw.identify.growth.search import Grown

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
        section = values.sections[:, number]
        poles = section_poles(*section[:2])
        if np.all(poles.imag == 0) and stands_in(poles.real, longest).any():
            structure, values = without_section(structure, values, number)
            for pole, residue in fractions_of(section):
                structure, values = with_separate_pole(structure, values, pole, residue)
    kept = ~stands_in(values.real[0], longest)
    if kept.all():
        return structure, values
    at = 1 + np.arange(structure.real_poles)
    starts = np.delete(values.starts, at[~kept], axis=1)
    starts[:, 0] += values.starts[:, at[~kept]].sum(axis=1)
    residue = values.integrator_residue + float(values.real[1, ~kept].sum())
    smaller = replace(structure, real_poles=int(kept.sum()))
    return smaller, replace(values, integrator_residue=residue, real=values.real[:, kept], starts=starts)
