"""Forces that depend on the motion, as a simulator with a force door takes them: friction and ripple.

All are accelerations, in output units per s^2: forces over the inertia that they act on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate import settings as S  # noqa: N812


@dataclass(frozen=True)
class ForceLaw:
    """Friction and ripple of `settings` (batch, COUNT) and, where given, a known `signal` (samples,).

    With position x and velocity v, d = sign v:

        a = - F (1 + d m) (1 + e exp(-(v / v_s)^2)) clip(v / v_0, -1, 1) - B (1 + d b) v
            + A sin(2 pi x / period + phase) + constant + signal(k)

    Coulomb friction F with its excess e at rest (Stribeck's curve, doi 10.1016/0005-1098(94)90209-7), viscous
    friction B, both unequal by direction (m, b), smoothed below v_0. A simulator that integrates with
    explicit steps h is stable where F h < 2 v_0.
    """

    settings: FloatArray
    signal: FloatArray | None = None

    def __call__(self, k: int, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Acceleration (batch,) at sample k, for positions and velocities (batch,)."""
        s = self.settings.T
        direction = np.sign(velocity)
        curve = 1 + s[S.MOTOR_STATIC] * np.exp(-((velocity / s[S.MOTOR_STRIBECK_SPEED]) ** 2))
        coulomb = s[S.MOTOR_FRICTION] * (1 + direction * s[S.MOTOR_ASYMMETRY]) * curve
        viscous = s[S.VISCOUS] * (1 + direction * s[S.VISCOUS_ASYMMETRY])
        rubbed = coulomb * np.clip(velocity / s[S.MOTOR_SMOOTHING], -1.0, 1.0) + viscous * velocity
        angle = 2 * np.pi * position / s[S.RIPPLE_PERIOD] + s[S.RIPPLE_PHASE]
        ripple = s[S.RIPPLE] * np.sin(angle) + s[S.RIPPLE_START]
        known = 0.0 if self.signal is None else float(self.signal[k])
        return np.asarray(ripple - rubbed + known)
