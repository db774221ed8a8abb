"""The printed Hammerstein-Wiener model of the azimuth axis of the Nanshan 26 m radio telescope.

Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012, eqs. 11 and 12. As printed, G(z) has a
pole at z = 1.0495 and diverges: its integrator and two slow poles lie so close together that rounding to four
digits drives them apart. `nanshan_linear_block` is a member of the rounding box that can be an axis; its
poles, zeros and gain stand here to the last digit so that they never change with the search that found them.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import ComplexArray
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock

SAMPLE_RATE_HZ = 20.0
SATURATION_LOWER = -0.335
SATURATION_UPPER = 0.438
LIGHT_DAMPING = 0.1
"""A complex pole pair damped less than this is a resonance; the others shape the slow response."""

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
"""Found by find_representative(nanshan_rounding_box(), SLOW_POLE_LIMIT), as the poles and
the gain were; of complex pairs the upper root is listed."""

REPRESENTATIVE_GAIN = 0.004828014029048065
REPRESENTATIVE_DELAY = 1

DEFAULT_DEAD_ZONE_HALF_WIDTH = 0.002
"""Units of y. The paper does not print delta; this value is a choice, see nanshan_model."""


def nanshan_linear_block() -> LinearBlock:
    """The stable representative of eq. 12 with an exact integrator.

    It is the member of the rounding box nearest to the printed coefficients, in the sum of squared
    displacements in units of half widths, under three conditions: A(1) = 0; slow poles within
    a modulus of 0.991; and the velocity gain at zero frequency equal to its plateau, without which the
    printed digits leave even its sign open.
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


def _with_conjugates(upper: tuple[complex, ...]) -> ComplexArray:
    roots: list[complex] = []
    for root in upper:
        roots.append(complex(root))
        if complex(root).imag > 0:
            roots.append(complex(root).conjugate())
    return np.array(roots, dtype=np.complex128)
