"""The printed Hammerstein-Wiener model of the azimuth axis of the Nanshan 26 m radio telescope.

Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012, eqs. 11 and 12. As printed, G(z) has a
pole at z = 1.0495 and diverges: its integrator and two slow poles lie so close together that rounding to four
digits drives them apart. `nanshan_linear_block` is a member of the rounding box that can be an axis; its
poles, zeros and gain stand here to the last digit so that they never change with the search that found them.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock
from bayes_hw.model.rounding_box import (
    LIGHT_DAMPING,
    RoundingBox,
    RoundingUncertainty,
    rounding_uncertainty,
)

SAMPLE_RATE_HZ = 20.0
SATURATION_LOWER = -0.335
SATURATION_UPPER = 0.438

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

REPRESENTATIVE_POLES = (
    1.0,
    0.9909999999999906,
    0.9884490912139821,
    -0.9912768126313004,
    -0.044992770702245215,
    complex(0.4969660287183927, 0.8344020362240844),
    complex(0.39443454348648804, 0.8768009737743142),
)
REPRESENTATIVE_ZEROS = (
    complex(0.9909904240012527, 0.004773438948698945),
    -0.882254057423987,
    complex(0.4765876260157746, 0.8571423667532843),
    complex(0.27932362371460107, 0.9083860626815292),
)
"""Found by find_representative(nanshan_rounding_box(), SLOW_POLE_LIMIT) in bayes_hw.model.representative, as
the poles and the gain were; of complex pairs the upper root is listed."""

REPRESENTATIVE_GAIN = 0.004828014029048065
REPRESENTATIVE_DELAY = 1

DEFAULT_DEAD_ZONE_HALF_WIDTH = 0.002
"""Units of y. The paper does not print delta; this value is a choice, see nanshan_model."""


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


def nanshan_linear_block() -> LinearBlock:
    """The stable representative of eq. 12 with an exact integrator.

    It is the member of the rounding box nearest to the printed coefficients, in the sum of squared
    displacements in units of half widths, under three conditions: A(1) = 0; slow poles within
    SLOW_POLE_LIMIT; and the velocity gain at zero frequency equal to its plateau, without which the printed
    digits leave even its sign open.
    """
    return LinearBlock(
        _with_conjugates(REPRESENTATIVE_ZEROS),
        _with_conjugates(REPRESENTATIVE_POLES),
        REPRESENTATIVE_GAIN,
        REPRESENTATIVE_DELAY,
    )


def nanshan_model(
    dead_zone_half_width: float = DEFAULT_DEAD_ZONE_HALF_WIDTH, noise_sigma: float = float("nan")
) -> HammersteinWiener:
    """The twin of the axis: eq. 11, the representative of eq. 12 and a dead zone, at 20 Hz.

    The dead zone's half width (units of y) is not printed, nor is the noise: both are the caller's choice.
    The default half width, 0.002, is about a third of the amplitude of w that the largest sine within both
    limits (0.335) gives at 1 Hz, and half of what it gives at the resonances: they stay visible in y.
    The dominant modes are the complex pole pairs with a damping ratio below LIGHT_DAMPING: two here.
    """
    linear = nanshan_linear_block()
    modes = linear.modes(SAMPLE_RATE_HZ)
    return HammersteinWiener(
        name="Nanshan 26 m azimuth",
        sample_rate_hz=SAMPLE_RATE_HZ,
        saturation=Saturation(SATURATION_LOWER, SATURATION_UPPER),
        linear=linear,
        dead_zone=DeadZone(dead_zone_half_width),
        dominant_modes=tuple(mode for mode in modes if mode.damping_ratio < LIGHT_DAMPING),
        noise_sigma=noise_sigma,
    )


def nanshan_rounding_uncertainty(
    rng: np.random.Generator,
    draws: int,
    gain_frequency_hz: FloatArray,
    significant_digits: int | None = PRINTED_DIGITS,
) -> RoundingUncertainty:
    """What rounding leaves uncertain of eq. 12; `rounding_uncertainty` of `nanshan_rounding_box`."""
    box = nanshan_rounding_box(significant_digits)
    return rounding_uncertainty(box, rng, draws, SAMPLE_RATE_HZ, gain_frequency_hz)


def _with_conjugates(upper: tuple[complex, ...]) -> ComplexArray:
    roots: list[complex] = []
    for root in upper:
        roots.append(complex(root))
        if complex(root).imag > 0:
            roots.append(complex(root).conjugate())
    return np.array(roots, dtype=np.complex128)
