"""Numbers by which compiled kernels know effects: rows of their parameters, laws, and what a law looks at."""

from __future__ import annotations

EARLY_RATE, LATE_RATE, LIMIT_SINE, LIMIT_COSINE, LIMIT_WAVENUMBER, LIMIT_SLOPE = range(6)
BIAS, CHANGE, WARMING, EVEN_CURVE, ODD_CURVE, HELD = range(6, 12)
INPUTS = 12

PLAY, LOG_RATIO, SINE, COSINE, WAVENUMBER, SINE2, COSINE2, RATE, SETTLING, SETTLING_TIME = range(10)
OUTPUTS = 10

COULOMB, STRIBECK, BRISTLE, RIPPLE, CUBIC, GAP, EXCESS, MODULATED, KNOWN, DRAG, SLIP, INNOVATION = range(12)
BASE_COMMAND, BASE_SPEED, BASE_TWIST, BASE_POSITION, BASE_TWIST_RATE = range(5)
THETAS = 3
"""Parameters of a law, at most."""
