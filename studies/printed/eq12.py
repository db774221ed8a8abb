"""Eq. 12 of the printed Nanshan model, to the digits in which it is printed.

Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012; see `printed.nanshan`.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from printed.nanshan import SAMPLE_RATE_HZ
from printed.rounding_box import RoundingBox, RoundingUncertainty, rounding_uncertainty

PRINTED_NUMERATOR = (
    *("0", "0", "0", "0.004828", "-0.01261", "0.0159"),
    *("-0.009702", "-0.003579", "0.01059", "-0.009064", "0.003634"),
)
"""Numerator of eq. 12 in powers of 1/z from z^0; its three leading zeros are exact."""

PRINTED_DENOMINATOR = (
    *("1", "-3.726", "6.032", "-4.712", "-0.486"),
    *("5.157", "-5.586", "3.056", "-0.6973", "-0.03809"),
)
"""Denominator of eq. 12 in powers of 1/z from z^0; its leading one is exact."""

PRINTED_DIGITS = 4
"""Significant digits of eq. 12. Fifteen of its numbers show four; 0.0159 and -0.486 show three, as
programs that print four and drop trailing zeros do, and are read as 0.01590 and -0.4860."""

SLOW_POLE_LIMIT = 0.991
"""Modulus allowed to the slow poles of the representative: they then decay no slower than the real pole
at -0.9913, the least damped one that the printed digits fix."""


def printed_coefficients() -> tuple[FloatArray, FloatArray]:
    """Numerator (11,) and denominator (10,) of eq. 12 in powers of 1/z, constant term first."""
    box = nanshan_rounding_box()
    return box.numerator, box.denominator


def rounding_half_widths() -> tuple[FloatArray, FloatArray]:
    """Half a unit of the fourth significant digit of each printed coefficient; zero where it is exact.

    Shapes as in `printed_coefficients`.
    """
    box = nanshan_rounding_box()
    return box.numerator_half_width, box.denominator_half_width


def nanshan_rounding_box(significant_digits: int | None = PRINTED_DIGITS) -> RoundingBox:
    """Every G that rounds to eq. 12.

    With `significant_digits` None every number is taken to end where its printed digits end: the intervals
    of 0.0159 and -0.486 are then ten times as wide, the others are the same.
    """
    return RoundingBox.from_text(PRINTED_NUMERATOR, PRINTED_DENOMINATOR, significant_digits)


def nanshan_rounding_uncertainty(
    rng: np.random.Generator,
    draws: int,
    gain_frequency_hz: FloatArray,
    significant_digits: int | None = PRINTED_DIGITS,
) -> RoundingUncertainty:
    """What rounding leaves uncertain of eq. 12; `rounding_uncertainty` of `nanshan_rounding_box`."""
    box = nanshan_rounding_box(significant_digits)
    return rounding_uncertainty(box, rng, draws, SAMPLE_RATE_HZ, gain_frequency_hz)
