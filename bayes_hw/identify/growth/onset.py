"""A free beginning of the impulse response, which the evidence cannot exclude.

A fast real pole or a sample of delay moves a resonance's frequency and damping by a standard deviation or
two long before the criterion asks for it. So the chosen cascade is given two fast real poles, one of which
answers within a sample, and a sample less of delay: the first samples of its impulse response are then free,
and what they could take from the resonances widens their intervals.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.cascade_roots import section_poles
from bayes_hw.identify.growth.extension import with_separate_pole
from bayes_hw.identify.growth.held_poles import fitted_with_held_poles
from bayes_hw.identify.growth.search import Grown

ONSET_POLES = (0.0, 0.5)

NEAR_ZERO = 0.05
"""A pole of smaller modulus has all but nothing from the second sample of its response on."""


def with_free_onset(item: Grown) -> Grown:
    """`item` with ONSET_POLES and, where it has one, a sample less of delay.

    It begins with the response of `item`, so that it fits no worse, and is fitted with every real pole where
    it is: one of little weight would go anywhere, to the integrator too.
    """
    structure, values = item.structure, item.values
    for pole in ONSET_POLES:
        structure, values = with_separate_pole(structure, values, pole)
    if structure.delay_samples:
        structure, values = earlier(structure, values, structure.real_poles - len(ONSET_POLES))
    return fitted_with_held_poles(structure, values, item)


def earlier(structure: Structure, values: CascadeValues, at_zero: int) -> tuple[Structure, CascadeValues]:
    """A sample less of delay with the response as it was, by means of real pole number `at_zero`, which is
    at zero and answers within a sample:

        r q^-2 / (1 - p q^-1) = (r / p) (q^-1 / (1 - p q^-1) - q^-1).

    Poles nearer to zero than NEAR_ZERO are moved so far from it, which changes the response beyond its second
    sample by less than NEAR_ZERO of their weight.
    """
    values = _off_zero(values, at_zero)
    kept = np.arange(structure.real_poles) != at_zero
    poles, residues = values.real[0, kept], values.real[1, kept]
    a1, a2, b1, b2 = values.sections
    first = b2 / a2
    real = values.real.copy()
    real[1, kept] = residues / poles
    real[1, at_zero] += float(np.sum(first) - np.sum(residues / poles)) - values.integrator_residue
    sections = np.stack([a1, a2, -first, b1 + first * a1])
    moved = replace(structure, delay_samples=structure.delay_samples - 1)
    return moved, replace(values, real=real, sections=sections)


def _off_zero(values: CascadeValues, at_zero: int) -> CascadeValues:
    """The cascade with every pole but number `at_zero` at least NEAR_ZERO from zero, weights as they are."""
    real, sections = values.real.copy(), values.sections.copy()
    for i in range(real.shape[1]):
        if i != at_zero:
            real[0, i] = _pushed(real[:1, i].astype(complex))[0].real
    for i, (a1, a2, b1, b2) in enumerate(values.sections.T):
        poles = section_poles(a1, a2)
        near = np.abs(poles) < NEAR_ZERO
        if not near.any():
            continue
        pushed = _pushed(poles)
        if near.all():
            # Both answer at once: the first two samples of the response stay.
            sections[:, i] = _denominator(pushed, b1, b2 + b1 * (a1 - float(np.sum(pushed).real)))
        else:
            weights = (b1 * poles + b2) / (poles - poles[::-1])
            numerator = np.sum(weights).real, -float((weights @ pushed[::-1]).real)
            sections[:, i] = _denominator(pushed, *numerator)
    return replace(values, real=real, sections=sections)


def _pushed(poles: ComplexArray) -> ComplexArray:
    size = np.abs(poles)
    direction = np.where(size > 0, poles / np.maximum(size, np.finfo(float).tiny), 1.0)
    return np.asarray(direction * np.maximum(size, NEAR_ZERO))


def _denominator(poles: ComplexArray, b1: float, b2: float) -> FloatArray:
    """a1, a2, b1, b2 of a section with these poles."""
    return np.array([np.sum(poles).real, np.prod(poles).real, b1, b2])
