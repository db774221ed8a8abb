"""A notch filter, to be put on a resonance."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from bayes_hw.errors import InputError

Section: TypeAlias = tuple[float, float, float, float, float]
"""b0, b1, b2, a1, a2 of (b0 + b1/z + b2/z^2) / (1 + a1/z + a2/z^2)."""


@dataclass(frozen=True)
class Notch:
    """(s^2 + 2 zeta_n w s + w^2) / (s^2 + 2 zeta_d w s + w^2) at w = 2 pi frequency_hz.

    Its gain is one far away and zeta_n / zeta_d at its frequency. Made discrete by Tustin's rule prewarped at
    w (Franklin, Powell and Workman, Digital Control of Dynamic Systems, sec. 6.3).
    """

    frequency_hz: float
    numerator_damping: float
    denominator_damping: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.frequency_hz) and self.frequency_hz > 0):
            raise InputError("notches: frequency_hz must be finite and positive")
        if not (np.isfinite(self.numerator_damping) and self.numerator_damping >= 0):
            raise InputError("notches: numerator_damping must be finite and zero or more")
        if not (np.isfinite(self.denominator_damping) and self.denominator_damping > 0):
            raise InputError("notches: denominator_damping must be finite and positive")

    def coefficients(self, period_s: float) -> Section:
        """The filter at a controller's period."""
        t = np.tan(np.pi * self.frequency_hz * period_s)
        scale = 1 + 2 * self.denominator_damping * t + t * t
        middle = 2 * (t * t - 1) / scale
        return (
            float((1 + 2 * self.numerator_damping * t + t * t) / scale),
            float(middle),
            float((1 - 2 * self.numerator_damping * t + t * t) / scale),
            float(middle),
            float((1 - 2 * self.denominator_damping * t + t * t) / scale),
        )

    @classmethod
    def from_dict(cls, data: Any, label: str) -> Notch:
        """Read {"frequency_hz", "numerator_damping", "denominator_damping"}."""
        keys = ("frequency_hz", "numerator_damping", "denominator_damping")
        if not isinstance(data, Mapping) or set(data) != set(keys):
            raise InputError(f"{label}: must be an object with {', '.join(keys)}")
        for key in keys:
            if isinstance(data[key], bool) or not isinstance(data[key], (int, float)):
                raise InputError(f"{label}.{key}: must be a number")
        try:
            return cls(*(float(data[key]) for key in keys))
        except OverflowError:
            raise InputError(f"{label}: holds a number that is too large") from None

    def to_dict(self) -> dict[str, float]:
        return {
            "frequency_hz": self.frequency_hz,
            "numerator_damping": self.numerator_damping,
            "denominator_damping": self.denominator_damping,
        }
