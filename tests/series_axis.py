"""An integrator and two modes one behind the other, a slow axis at a high rate."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import ComplexArray
from bayes_hw.identify.cascade import CascadeValues, Structure
from bayes_hw.identify.growth.extension import section_of

RATE, DELAY = 200.0, 20
STRUCTURE = Structure(DELAY, True, 0, 2, lower=True, upper=True, dead_zone=True)
MODES = ((2.6, 0.03), (4.9, 0.05))


def series(held: bool, records: int) -> CascadeValues:
    """Of unit velocity gain: a G(z) without zeros, or the same in continuous time behind a `held` command."""
    s = np.array([0.0, *(s for f, d in MODES for s in _pair(f, d))])
    z = np.exp(s)
    x = s if held else z
    residues = 1 / np.prod(x[:, None] - x + np.eye(5), axis=1)
    if held:
        residues[1:] *= (z[1:] - 1) / s[1:]
    return _values_of(z, residues / (residues[0] * RATE), records)


def _pair(frequency_hz: float, damping_ratio: float) -> tuple[complex, complex]:
    """Poles of continuous time, per sample."""
    one = 2 * np.pi * frequency_hz / RATE * complex(-damping_ratio, np.sqrt(1 - damping_ratio**2))
    return one, one.conjugate()


def _values_of(z: ComplexArray, residues: ComplexArray, records: int) -> CascadeValues:
    sections = np.stack([section_of(z[i : i + 2], residues[i : i + 2]) for i in (1, 3)], axis=1)
    gain, starts = float(residues[0].real), np.zeros((records, 5))
    return CascadeValues(-0.45, 0.4, 0.03, 0.0, gain, np.zeros((2, 0)), sections, starts)
