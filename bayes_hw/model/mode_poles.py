"""Sampled poles of many modes at once: `bayes_hw.model.linear.mode_pole` lane by lane, compiled."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.model.lane_functions import cosine, exponential, sine, square_root
from bayes_hw.model.lanes import LANES, broadcast, filled_up, load, store


def mode_poles(frequency_hz: FloatArray, damping_ratio: FloatArray, sample_rate_hz: float) -> ComplexArray:
    """exp(2 pi f (-zeta + i sqrt(1 - zeta^2)) / rate) of modes (modes, walkers), |damping_ratio| < 1."""
    modes, walkers = frequency_hz.shape
    given = filled_up(np.stack([frequency_hz, damping_ratio]))
    parts = np.empty_like(given)
    _mode_poles(given, 2 * np.pi / sample_rate_hz, parts)
    poles = np.empty((modes, walkers), dtype=np.complex128)
    poles.real, poles.imag = parts[:, :, :walkers]
    return poles


@compiled
def _mode_poles(given, turn, parts):  # type: ignore[no-untyped-def]
    """Fill `parts` with real and imaginary parts, given frequencies and damping ratios, in one shape."""
    rows = given.shape[1] * given.shape[2] // LANES
    for row in range(rows):
        angle, damping = broadcast(turn) * load(given, row), load(given, rows + row)
        radius = exponential(broadcast(0.0) - angle * damping)
        turned = angle * square_root(broadcast(1.0) - damping * damping)
        store(parts, row, radius * cosine(turned))
        store(parts, rows + row, radius * sine(turned))


@compiled
def squared_distances(frequency_hz, damping_ratio, sample_rate_hz, point):  # type: ignore[no-untyped-def]
    """Product (walkers,) of |point - pole|^2 over the poles of modes (modes, walkers), of each pair the upper
    one, `point` real."""
    modes, walkers = frequency_hz.shape
    product = np.ones(walkers)
    for i in range(modes):
        for k in range(walkers):
            angle, damping = 2 * np.pi / sample_rate_hz * frequency_hz[i, k], damping_ratio[i, k]
            radius, turn = np.exp(-angle * damping), angle * np.sqrt(1 - damping * damping)
            product[k] *= (point - radius * np.cos(turn)) ** 2 + (radius * np.sin(turn)) ** 2
    return product
