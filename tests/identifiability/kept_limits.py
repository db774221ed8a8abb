"""What commands within motion limits are held against."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.motion_limits import MotionLimits


def keeps_to(limits: MotionLimits, u: FloatArray, rate_hz: float) -> bool:
    """Whether a command (samples,), from rest to rest, keeps to both limits (to rounding)."""
    steps = np.abs(np.diff(u, prepend=0.0, append=0.0)) * rate_hz
    slack = 1 + 1e-9
    return bool(np.abs(u).max() <= limits.velocity * slack and steps.max() <= limits.acceleration * slack)
