"""Axes and records with known answers for the tests of identification."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.excitation import random_phase_multisine
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record, Units

RATE_HZ = 20.0
MODES = (Mode(1.8, 0.05), Mode(3.7, 0.03))


def known_axis(
    lower: float = -0.3, upper: float = 0.42, half_width: float = 0.05, delay_samples: int = 2
) -> HammersteinWiener:
    """An integrator, a lag and two lightly damped modes, with a velocity gain of one per second."""
    pairs = [mode.pole(RATE_HZ) for mode in MODES]
    poles = np.array([1.0, 0.5, *pairs, *np.conj(pairs)], dtype=complex)
    zero = Mode(2.6, 0.08).pole(RATE_HZ)
    zeros = np.array([zero, np.conj(zero), 0.2], dtype=complex)
    unscaled = LinearBlock(zeros, poles, 1.0, delay_samples)
    linear = LinearBlock(zeros, poles, 1.0 / unscaled.velocity_gain(RATE_HZ), delay_samples)
    return HammersteinWiener("known", RATE_HZ, Saturation(lower, upper), linear, DeadZone(half_width), MODES)


def commands(rng: np.random.Generator, count: int, rms: float, seconds: float = 60.0) -> list[FloatArray]:
    """Multisines from near standstill to 5 Hz: their slow part carries the axis across zero."""
    return [random_phase_multisine(rng, RATE_HZ, seconds, rms, 1 / seconds, 5.0) for _ in range(count)]


def simulated_records(
    model: HammersteinWiener,
    inputs: Sequence[FloatArray],
    rng: np.random.Generator,
    sigma: float = 0.0,
    initial_position: float = 0.0,
) -> list[Record]:
    """One record per command, with white noise of standard deviation `sigma`."""
    return [
        Record(
            f"record_{number}",
            np.arange(len(u)) / model.sample_rate_hz,
            u,
            model.simulate(u, initial_position).y + sigma * rng.standard_normal(len(u)),
            model.sample_rate_hz,
            Units(),
        )
        for number, u in enumerate(inputs, start=1)
    ]
