"""Numbers by which compiled kernels know effects: rows of their parameters, laws, and what a law looks at."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray

EARLY_RATE, LATE_RATE, LIMIT_SINE, LIMIT_COSINE, LIMIT_WAVENUMBER, LIMIT_LEAD, LIMIT_SLOPE = range(7)
BIAS, CHANGE, WARMING, EVEN_CURVE, ODD_CURVE, HELD = range(7, 13)
INPUTS = 13

PLAY, LOG_RATIO, SINE, COSINE, WAVENUMBER, SINE2, COSINE2, RATE, SETTLING, SETTLING_TIME = range(10)
OUTPUTS = 10

COULOMB, STRIBECK, BRISTLE, RIPPLE, CUBIC, GAP, EXCESS, MODULATED, KNOWN, DRAG, SLIP, INNOVATION = range(12)
BASE_COMMAND, BASE_SPEED, BASE_TWIST, BASE_POSITION, BASE_TWIST_RATE, BASE_MOTOR = range(6)
THETAS = 3
"""Parameters of a law, at most."""


def idle_inputs(*shape: int) -> FloatArray:
    """Parameters (*shape, INPUTS) of effects on the command that change nothing; limits look at the angle as
    it is in the middle of a sample."""
    found = np.zeros((*shape, INPUTS))
    found[..., WARMING], found[..., LIMIT_LEAD] = 1.0, 0.5
    return found
