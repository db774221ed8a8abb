"""Larger and smaller cascades that begin with the same response: what a search moves between."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure

COINCIDING = 1e-6
"""Real poles closer than this are left paired as they are: their residues would lose their digits."""


def with_section(
    structure: Structure, values: CascadeValues, a1: float, a2: float
) -> tuple[Structure, CascadeValues]:
    """One more second-order section, of zero weight."""
    section = np.array([[a1], [a2], [0.0], [0.0]])
    starts = np.concatenate([values.starts, np.zeros((len(values.starts), 2))], axis=1)
    larger = replace(structure, sections=structure.sections + 1)
    return larger, replace(values, sections=np.concatenate([values.sections, section], axis=1), starts=starts)


def with_real_pole(
    structure: Structure, values: CascadeValues, pole: float
) -> tuple[Structure, CascadeValues]:
    """One more real pole, of zero weight; it joins a single real pole into a section, which may then turn
    into a pair without a seam."""
    if structure.real_poles == 1:
        return joined_pole(structure, values, pole)
    return with_separate_pole(structure, values, pole)


def with_separate_pole(
    structure: Structure, values: CascadeValues, pole: float, residue: float = 0.0
) -> tuple[Structure, CascadeValues]:
    """One more real pole, at rest, that stays real."""
    at = int(structure.integrator) + structure.real_poles
    starts = np.insert(values.starts, at, 0.0, axis=1)
    real = np.concatenate([values.real, [[pole], [residue]]], axis=1)
    return replace(structure, real_poles=structure.real_poles + 1), replace(values, real=real, starts=starts)


def joined_pole(structure: Structure, values: CascadeValues, pole: float) -> tuple[Structure, CascadeValues]:
    """The first real pole and a new one of zero weight as a section."""
    p, residue = values.real[:, 0]
    section = np.array([p + pole, p * pole, residue, -residue * pole])
    at = int(structure.integrator)
    held = values.starts[:, at]
    free = np.stack([held, held * (p - 1)], axis=1)
    starts = np.concatenate([np.delete(values.starts, at, axis=1), free], axis=1)
    larger = replace(structure, real_poles=structure.real_poles - 1, sections=structure.sections + 1)
    return larger, replace(
        values,
        real=values.real[:, 1:],
        sections=np.concatenate([values.sections, section[:, None]], axis=1),
        starts=starts,
    )


def advanced(structure: Structure, values: CascadeValues) -> tuple[Structure, CascadeValues]:
    """One more sample of delay, the impulse response shifted by one sample and its first value dropped."""
    a1, a2, b1, b2 = values.sections
    sections = np.stack([a1, a2, a1 * b1 + b2, -a2 * b1])
    real = np.stack([values.real[0], values.real[0] * values.real[1]])
    later = replace(structure, delay_samples=structure.delay_samples + 1)
    return later, replace(values, real=real, sections=sections)


def without_real_pole(
    structure: Structure, values: CascadeValues, number: int
) -> tuple[Structure, CascadeValues]:
    """One real pole fewer."""
    at = int(structure.integrator) + number
    smaller = replace(structure, real_poles=structure.real_poles - 1)
    return smaller, replace(
        values, real=np.delete(values.real, number, axis=1), starts=np.delete(values.starts, at, axis=1)
    )


def without_section(
    structure: Structure, values: CascadeValues, number: int
) -> tuple[Structure, CascadeValues]:
    """One section fewer."""
    at = int(structure.integrator) + structure.real_poles + 2 * number
    starts = np.delete(values.starts, [at, at + 1], axis=1)
    smaller = replace(structure, sections=structure.sections - 1)
    return smaller, replace(values, sections=np.delete(values.sections, number, axis=1), starts=starts)


def with_parted_section(
    structure: Structure, values: CascadeValues, number: int
) -> tuple[Structure, CascadeValues]:
    """A section of two real poles as two of their own, at rest."""
    section = values.sections[:, number]
    structure, values = without_section(structure, values, number)
    for pole, residue in fractions_of(section):
        structure, values = with_separate_pole(structure, values, pole, residue)
    return structure, values


def with_single_poles(structure: Structure, values: CascadeValues) -> tuple[Structure, CascadeValues]:
    """Every section of two real poles parted, unless they all but coincide."""
    for number in reversed(range(structure.sections)):
        a1, a2 = values.sections[:2, number]
        if a1 * a1 / 4 - a2 > COINCIDING**2 / 4:
            structure, values = with_parted_section(structure, values, number)
    return structure, values


def repaired(structure: Structure, values: CascadeValues) -> CascadeValues | None:
    """Sections of real poles paired anew, neighbours together, so that any two may become a pair.

    None where there is nothing to pair otherwise, or where poles all but coincide. Only for records that
    start at rest.
    """
    a1, a2, _, _ = values.sections
    discriminant = a1 * a1 / 4 - a2
    chosen = np.flatnonzero(discriminant > 0)
    if len(chosen) < 2 or structure.free_start:
        return None
    poles, residues = [], []
    for i in chosen:
        for pole, residue in fractions_of(values.sections[:, i]):
            poles.append(pole)
            residues.append(residue)
    order = np.argsort(poles)
    poles_sorted, residues_sorted = np.array(poles)[order], np.array(residues)[order]
    if np.min(np.diff(poles_sorted)) < COINCIDING:
        return None
    sections = values.sections.copy()
    for i, k in zip(chosen, range(0, len(order), 2), strict=True):
        sections[:, i] = section_of(poles_sorted[k : k + 2], residues_sorted[k : k + 2])
    same = np.allclose(np.sort(sections[0, chosen]), np.sort(a1[chosen]), rtol=0, atol=1e-12)
    return None if same else replace(values, sections=sections)


def fractions_of(section: FloatArray) -> tuple[tuple[float, float], tuple[float, float]]:
    """Pole and residue of both fractions of a section (4,) of two real poles, the larger pole first."""
    a1, a2, b1, b2 = section
    root = np.sqrt(a1 * a1 / 4 - a2)
    one, other = a1 / 2 + root, a1 / 2 - root
    return (one, (b1 * one + b2) / (one - other)), (other, (b1 * other + b2) / (other - one))


DOUBLE = 1e-6
"""Half the distance that two equal poles are set apart."""


def pair_of(section: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Poles (2,) and residues (2,) of a section (4,), real or a pair; equal poles are set apart."""
    a1, a2, b1, b2 = section
    root = np.sqrt(complex(a1 * a1 / 4 - a2))
    poles = np.array([a1 / 2 + root, a1 / 2 - root])
    if abs(poles[0] - poles[1]) < 2 * DOUBLE:
        poles = poles + np.array([DOUBLE, -DOUBLE])
    return poles, (b1 * poles + b2) / np.array([poles[0] - poles[1], poles[1] - poles[0]])


def section_of(poles: FloatArray | ComplexArray, residues: FloatArray | ComplexArray) -> FloatArray:
    """a1, a2, b1, b2 of r1 q / (1 - p1 q) + r2 q / (1 - p2 q), real or a pair."""
    (p1, p2), (r1, r2) = poles, residues
    return np.asarray(np.real([p1 + p2, p1 * p2, r1 + r2, -(r1 * p2 + r2 * p1)]))
