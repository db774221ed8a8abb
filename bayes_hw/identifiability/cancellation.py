"""Poles and zeros that nearly cancel: the records see little of either.

Leaving out a group of poles P and as many zeros Z divides G by

    r(zeta) = prod_Z (zeta - z) / prod_P (zeta - p)

at the point zeta = exp(2 pi i f / rate). The group nearly cancels where |r - 1| is small at every frequency.
A group is closed under conjugation: one real root, a conjugate pair, or two real roots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, TypeAlias

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

NEARLY = 0.2
"""Poles and zeros nearly cancel when leaving them out changes G by less than this share everywhere."""

FREQUENCIES = 1024

Group: TypeAlias = tuple[complex, ...]


@dataclass(frozen=True)
class Cancellation:
    """Poles and zeros of G whose common removal changes it by at most the share `change`.

    `frequency_hz` is that of the first pole's angle, zero for real poles.
    """

    poles: Group
    zeros: Group
    change: float
    frequency_hz: float

    def to_dict(self) -> dict[str, Any]:
        """Plain data of identifiability.json."""
        return {
            "poles": [[root.real, root.imag] for root in self.poles],
            "zeros": [[root.real, root.imag] for root in self.zeros],
            "largest_change": self.change,
            "frequency_hz": self.frequency_hz,
        }


def near_cancellations(model: HammersteinWiener, limit: float = NEARLY) -> tuple[Cancellation, ...]:
    """Groups of poles and zeros, each root used once, whose removal changes G by less than `limit`."""
    candidates = []
    for poles in _groups(model.linear.poles):
        for zeros in _groups(model.linear.zeros):
            if len(poles) == len(zeros):
                change = largest_change(np.array(poles), np.array(zeros))
                if change < limit:
                    candidates.append((len(poles), change, poles, zeros))
    found: list[Cancellation] = []
    used: set[tuple[str, complex]] = set()
    for _, change, poles, zeros in sorted(candidates, key=lambda each: each[:2]):
        roots = {*(("pole", root) for root in poles), *(("zero", root) for root in zeros)}
        if not roots & used:
            used |= roots
            frequency = abs(float(np.angle(poles[0]))) / (2 * np.pi) * model.sample_rate_hz
            found.append(Cancellation(poles, zeros, change, frequency))
    return tuple(found)


def largest_change(poles: ComplexArray, zeros: ComplexArray) -> float:
    """Largest |r - 1| over the frequencies; infinite for a pole on the unit circle."""
    if np.any(np.abs(poles) >= 1):
        return float("inf")
    angles: FloatArray = np.concatenate([np.linspace(0, np.pi, FREQUENCIES), np.abs(np.angle(poles))])
    zeta = np.exp(1j * angles)[:, None]
    ratio = np.prod(zeta - zeros, axis=1) / np.prod(zeta - poles, axis=1)
    return float(np.max(np.abs(ratio - 1)))


def _groups(roots: ComplexArray) -> Sequence[Group]:
    """Every real root, every conjugate pair, every two real roots."""
    real = [complex(root) for root in roots if root.imag == 0]
    pairs = [(complex(root), complex(root.conjugate())) for root in roots if root.imag > 0]
    return [*((root,) for root in real), *pairs, *combinations(real, 2)]
