"""The loop over frequency: bands of its sensitivities, and some of its draws near the critical point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.control.loop import Loop
from bayes_hw.infer.summary import INTERVAL_PROBABILITY

CURVES = 24
"""Draws whose Nyquist curves are kept."""

BAND_DRAWS = 500


@dataclass(frozen=True, eq=False)
class LoopBands:
    """S = 1 / (1 + L) and T = L / (1 + L) in dB: pointwise central 94 % (2, frequencies) and that of the
    point estimate (frequencies,); L of some draws (curves, frequencies) and of the point estimate."""

    frequency_hz: FloatArray
    sensitivity_db: FloatArray
    nominal_sensitivity_db: FloatArray
    complementary_db: FloatArray
    nominal_complementary_db: FloatArray
    curves: ComplexArray
    nominal_curve: ComplexArray


def loop_bands(loop: Loop, nominal: Loop) -> LoopBands:
    """Bands of the first BAND_DRAWS draws of `loop`."""
    frequency = loop.frequency_hz
    few = Loop(loop.axis.take(np.arange(min(BAND_DRAWS, loop.axis.count))), loop.controller)
    response, centre = few.response(frequency), nominal.response(frequency)[0]
    tails = [(1 - INTERVAL_PROBABILITY) / 2, (1 + INTERVAL_PROBABILITY) / 2]

    def band(values: ComplexArray) -> FloatArray:
        return np.asarray(20 * np.log10(np.quantile(np.abs(values), tails, axis=0)), dtype=np.float64)

    def decibel(values: ComplexArray) -> FloatArray:
        return np.asarray(20 * np.log10(np.abs(values)), dtype=np.float64)

    return LoopBands(
        frequency,
        band(1 / (1 + response)),
        decibel(1 / (1 + centre)),
        band(response / (1 + response)),
        decibel(centre / (1 + centre)),
        response[:CURVES],
        centre,
    )
