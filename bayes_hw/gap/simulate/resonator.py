"""A further structural mode hung on the drive train: a tuned mass.

The torque per angle that it takes from its host, of whose inertia it has the share mu, is

    X = mu s^2 (2 zeta omega s + omega^2) / (s^2 + 2 zeta omega s + omega^2)

(Den Hartog, Mechanical Vibrations, section 3.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray


@dataclass(frozen=True)
class Resonator:
    """Inertia over its host's, natural frequency, damping; its host is the load, or the structure."""

    inertia_ratio: float
    frequency_hz: float
    damping_ratio: float
    on_structure: bool = False

    @cached_property
    def own(self) -> FloatArray:
        """Its own polynomial (3,), the denominator of X, highest power first."""
        omega = 2 * np.pi * self.frequency_hz
        return np.array([1.0, 2 * self.damping_ratio * omega, omega**2])

    @cached_property
    def resisting(self) -> FloatArray:
        """The numerator of X (4,), highest power first."""
        return np.concatenate([self.inertia_ratio * self.own[1:], [0.0, 0.0]])
