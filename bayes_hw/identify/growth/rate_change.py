"""A cascade found at a lower rate as one at a higher rate, every component with its own step response."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.identify.cascade import CascadeValues, Structure

FASTEST = 0.02
"""A pole at or below this value at the lower rate, which no continuous-time mode gives, is taken for it: the
axis has settled within a sample."""


def at_higher_rate(
    structure: Structure, values: CascadeValues, factor: int, records: int
) -> tuple[Structure, CascadeValues]:
    """The cascade for a rate `factor` times as high, with starts (records, order) of zero.

    For a command held over each sample, a pole p of residue r is a mode whose step response at the samples is
    r (1 - p^k) / (1 - p): at the higher rate its pole is p^(1 / factor) and its residue
    r (1 - p^(1 / factor)) / (1 - p) (Ljung, System Identification, sec. 4.5). The delay is `factor` times as
    many samples.
    """
    poles, residues = _faster(values.real[0].astype(complex), values.real[1].astype(complex), factor)
    sections = np.empty_like(values.sections)
    for number, (a1, a2, b1, b2) in enumerate(values.sections.T):
        root = np.sqrt(complex(a1 * a1 / 4 - a2))
        pair = np.array([a1 / 2 + root, a1 / 2 - root])
        if abs(pair[0] - pair[1]) < 2 * DOUBLE:
            pair = pair + np.array([DOUBLE, -DOUBLE])
        parts = (b1 * pair + b2) / np.array([pair[0] - pair[1], pair[1] - pair[0]])
        (p1, p2), (r1, r2) = _faster(pair, parts, factor)
        sections[:, number] = np.real([p1 + p2, p1 * p2, r1 + r2, -(r1 * p2 + r2 * p1)])
    moved = replace(structure, delay_samples=structure.delay_samples * factor)
    real: FloatArray = np.stack([poles.real, residues.real])
    return moved, replace(
        values,
        integrator_residue=values.integrator_residue / factor,
        real=real,
        sections=sections,
        starts=np.zeros((records, structure.order)),
    )


DOUBLE = 1e-6
"""Half the distance that two equal poles are set apart."""


def _faster(poles: ComplexArray, residues: ComplexArray, factor: int) -> tuple[ComplexArray, ComplexArray]:
    steady = residues / (1 - poles)
    possible = np.where((poles.imag == 0) & (poles.real < FASTEST), FASTEST, poles)
    roots = possible ** (1 / factor)
    return np.asarray(roots, np.complex128), np.asarray(steady * (1 - roots), np.complex128)
