"""The static blocks of a Hammerstein-Wiener axis.

Equation numbers are those of Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError


@dataclass(frozen=True)
class GainNormalization:
    """The three gains that the paper sets to one, so that the gain of G carries everything.

    c1 is the slope of the saturation, c2 and c3 those of the dead zone above and below it (eqs. 1 and 5).
    c1 and c2 can be set to one at no cost (v -> a v, w -> b w changes no output); c3 = c2 is an assumption.
    """

    c1: float = 1.0
    c2: float = 1.0
    c3: float = 1.0

    def __post_init__(self) -> None:
        for label, value in (("c1", self.c1), ("c2", self.c2), ("c3", self.c3)):
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"normalization.{label}: must be finite and positive")


@dataclass(frozen=True)
class Saturation:
    """f(u) = min(max(gain u, lower), upper) (eq. 1); limits in units of v, lower < 0 < upper."""

    lower: float
    upper: float
    gain: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.lower) and np.isfinite(self.upper)):
            raise InputError("saturation: limits must be finite numbers")
        if not self.lower < 0 < self.upper:
            raise InputError(f"saturation: needs lower < 0 < upper, got {self.lower:g} and {self.upper:g}")

    def __call__(self, u: FloatArray) -> FloatArray:
        """v for every command u."""
        return np.clip(self.gain * np.asarray(u, dtype=np.float64), self.lower, self.upper)


@dataclass(frozen=True)
class DeadZone:
    """n(w) = gain_positive (w - half_width), 0 or gain_negative (w + half_width) (eq. 5).

    `half_width` (delta) is in units of w; the gains are c2 and c3.
    """

    half_width: float
    gain_positive: float = 1.0
    gain_negative: float = 1.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.half_width) and self.half_width >= 0):
            raise InputError("dead_zone.half_width: must be finite and zero or more")

    def __call__(self, w: FloatArray) -> FloatArray:
        """y for every w."""
        w = np.asarray(w, dtype=np.float64)
        above = self.gain_positive * np.maximum(w - self.half_width, 0)
        below = self.gain_negative * np.minimum(w + self.half_width, 0)
        return above + below
