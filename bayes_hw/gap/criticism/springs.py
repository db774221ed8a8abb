"""Shapes of a gear whose stiffness and damping change with the amplitude of its torsion.

Near one amplitude a spring that is not linear acts as a linear one of another stiffness and damping (harmonic
balance: Krylov and Bogoliubov, Introduction to Nonlinear Mechanics, 1943). These follow the ringing that such
a spring shifts in phase, where a function of the torsion now would not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.criticism.free_functions import Motion, linear_splines
from bayes_hw.gap.simulate.builder import SignalChain

AMPLITUDES = 3
"""Linear splines over the amplitude."""


def shapes_of_springs(found: Sequence[Motion], chain: SignalChain, scale: AxisScale) -> list[FloatArray]:
    """Torsion and its rate at every amplitude, shapes (samples, 2 AMPLITUDES) a record, of a gear torque.

    The amplitude is the root mean square over the last period of the first mode. No shapes (samples, 0)
    where the drive train is not known.
    """
    nothing = [np.zeros((len(m.w), 0)) for m in found]
    torsion = [chain.torsions(m.limited[:, None])[:, 0] for m in found]
    if not any(np.any(phi) for phi in torsion):
        return nothing
    period = max(round(scale.rate / scale.first_mode_hz), 1)
    amplitudes = linear_splines([_recent_rms(phi, period) for phi in torsion], AMPLITUDES)
    return [
        np.concatenate([phi[:, None] * own, np.gradient(phi)[:, None] * scale.rate * own], axis=1)
        for phi, own in zip(torsion, amplitudes, strict=True)
    ]


def _recent_rms(signal: FloatArray, period: int) -> FloatArray:
    """Root mean square (samples,) of a signal over the last `period` samples, zeros before the first."""
    sums = np.cumsum(np.concatenate([np.zeros(period), signal**2]))
    return np.sqrt(np.maximum(sums[period:] - sums[:-period], 0.0) / period)
