"""Describing functions of the static blocks: what they do to the first harmonic of a sinusoid.

Gelb and Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design, 1968, secs. 2.3, 6.2.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray

BISECTIONS = 60


def saturation_gain(
    amplitude: FloatArray, lower: FloatArray, upper: FloatArray, bias: FloatArray | float = 0.0
) -> FloatArray:
    """First-harmonic gain of min(max(x, lower), upper) for x = bias + amplitude sin(angle).

        N = (g((upper - bias) / A) + g((bias - lower) / A)) / 2,   g(x) = 2/pi (asin x + x sqrt(1 - x^2))

    with x cut to [-1, 1]. Arrays broadcast.
    """
    above, below = (upper - bias) / amplitude, (bias - lower) / amplitude
    return (_odd_share(above) + _odd_share(below)) / 2


def saturation_mean(
    amplitude: FloatArray, lower: FloatArray, upper: FloatArray, bias: FloatArray | float
) -> FloatArray:
    """Mean of min(max(bias + amplitude sin(angle), lower), upper) over one period."""
    return (
        lower
        + amplitude * _mean_excess((lower - bias) / amplitude)
        - amplitude * _mean_excess((upper - bias) / amplitude)
    )


def balancing_bias(amplitude: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """The bias for which `saturation_mean` is zero: an integrator behind the block allows no other.

    By bisection between the limits' midpoint for large amplitudes and zero for small ones.
    """
    low = np.broadcast_to(
        -amplitude - np.abs(lower), np.broadcast_shapes(np.shape(amplitude), np.shape(lower))
    )
    high = -low + np.abs(upper)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        positive = saturation_mean(amplitude, lower, upper, middle) > 0
        low, high = np.where(positive, low, middle), np.where(positive, middle, high)
    return np.asarray((low + high) / 2, dtype=np.float64)


def dead_zone_gain(amplitude: FloatArray, half_width: FloatArray) -> FloatArray:
    """First-harmonic gain of the dead zone (eq. 5 with unit gains) for amplitude sin(angle): 1 - g(delta /
    A).

    Zero amplitudes have gain one where the dead zone has no width, else zero.
    """
    safe = np.where(amplitude > 0, amplitude, 1.0)
    share = np.where(amplitude > 0, half_width / safe, np.where(half_width > 0, np.inf, 0.0))
    return 1 - _odd_share(share)


def _odd_share(x: FloatArray) -> FloatArray:
    """g(x) = 2/pi (asin x + x sqrt(1 - x^2)), x cut to [-1, 1]."""
    cut = np.clip(x, -1, 1)
    return np.asarray(2 / np.pi * (np.arcsin(cut) + cut * np.sqrt(1 - cut**2)), dtype=np.float64)


def _mean_excess(x: FloatArray) -> FloatArray:
    """Mean of max(sin(angle) - x, 0) over one period."""
    cut = np.clip(x, -1, 1)
    inside = (np.sqrt(1 - cut**2) - cut * np.arccos(cut)) / np.pi
    return np.asarray(np.where(x < -1, -x, np.where(x > 1, 0.0, inside)), dtype=np.float64)
