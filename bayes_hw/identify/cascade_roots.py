"""Between a cascade's sections and the poles and zeros of its linear block."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import ComplexArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.model.block_of_fractions import block_of_fractions
from bayes_hw.model.linear import STABILITY_MARGIN, LinearBlock


def poles_of(values: CascadeValues, integrator: bool) -> ComplexArray:
    """Every pole of G, the integrator first."""
    parts = [np.ones(int(integrator), complex), values.real[0].astype(complex)]
    parts += [section_poles(a1, a2) for a1, a2 in values.sections[:2].T]
    return np.concatenate(parts)


def with_poles(structure: Structure, poles: ComplexArray) -> CascadeValues:
    """Denominators with the given poles (the integrator not among them), zero residues and states.

    Pairs become sections first, then real poles two at a time, and the one left over is first-order; poles
    outside the unit circle are mirrored into it. `poles` has `structure.order` entries less the integrator.
    """
    radius = np.abs(poles)
    inside = np.where(radius >= 1, poles / np.maximum(radius, 1e-12) ** 2, poles)
    inside = inside * np.minimum(1.0, 0.9995 / np.maximum(np.abs(inside), 1e-12))
    upper = inside[inside.imag > 0]
    reals = np.sort(inside[inside.imag == 0].real)[::-1]
    single, reals = reals[: structure.real_poles], reals[structure.real_poles :]
    denominators = [(2 * p.real, -(abs(p) ** 2)) for p in upper]
    denominators += [(a + b, -a * b) for a, b in zip(reals[0::2], reals[1::2], strict=True)]
    sections = np.zeros((4, structure.sections))
    for i, (a1, minus_a2) in enumerate(denominators):
        sections[:2, i] = a1, -minus_a2
    return CascadeValues(
        -np.inf,
        np.inf,
        0.0,
        0.0,
        0.0,
        np.stack([single, np.zeros_like(single)]),
        sections,
        np.zeros((0, structure.order)),
    )


def linear_block(structure: Structure, values: CascadeValues) -> LinearBlock:
    """G as poles, zeros, gain and delay, without poles and sections that have no weight at all."""
    values = inside_the_circle(_with_weight(values))
    real = values.real
    if structure.integrator:
        real = np.concatenate([[[1.0], [values.integrator_residue]], real], axis=1)
    poles = poles_of(values, structure.integrator)
    return block_of_fractions(real, values.sections, 0.0, poles, structure.delay_samples)


def _with_weight(values: CascadeValues) -> CascadeValues:
    real, sections = values.real[1] != 0, np.any(values.sections[2:] != 0, axis=0)
    if not (real.any() or sections.any()):
        return values
    return replace(values, real=values.real[:, real], sections=values.sections[:, sections])


def inside_the_circle(values: CascadeValues) -> CascadeValues:
    """Values whose poles, the integrator apart, are off the unit circle by as little as no record shows: a
    descent may take a section to the very corner of where it is stable.
    """
    largest = 1 - 2 * STABILITY_MARGIN
    real, sections = values.real.copy(), values.sections.copy()
    real[0] = np.clip(real[0], -largest, largest)
    for section in sections.T:
        radius = float(np.abs(section_poles(section[0], section[1])).max())
        section[:2] *= np.minimum(largest / max(radius, largest), 1.0) ** np.array([1, 2])
    return replace(values, real=real, sections=sections)


def section_poles(a1: float, a2: float) -> ComplexArray:
    """Both poles of a section's denominator 1 - a1 q^-1 + a2 q^-2, a pair or two real ones."""
    half, discriminant = a1 / 2, a1 * a1 / 4 - a2
    if discriminant < 0:
        imaginary = np.sqrt(-discriminant)
        return np.array([half + 1j * imaginary, half - 1j * imaginary])
    larger = half + np.copysign(np.sqrt(discriminant), half)
    return np.array([larger, a2 / larger if larger else 0.0], dtype=complex)
