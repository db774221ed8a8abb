"""Where in time and frequency a residual stands out of the noise."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import spectrogram

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.explanation import Explanation

WINDOWS = 24
"""Windows that fit into a record, before they are made to overlap by three quarters."""

SHORTEST_WINDOW = 32


@dataclass(frozen=True, eq=False)
class ResidualMap:
    """`decibels` (frequencies, times) of a residual's power over the noise; Hz, s from the first sample."""

    times: FloatArray
    frequencies: FloatArray
    decibels: FloatArray


def noise_power(explanation: Explanation, frequencies: FloatArray) -> FloatArray:
    """Power a sample (output units squared) of the encoder noise under an explanation, at frequencies in Hz.

    Of a stochastic effect the encoder's own noise counts, taken for white, and not the effect's.
    """
    if explanation.stochastic is not None:
        return np.full(len(frequencies), explanation.encoder_sigma**2)
    return explanation.fit.whitener.power(frequencies / explanation.fit.hypothesis.scale.rate)


def residual_map(residual: FloatArray, explanation: Explanation) -> ResidualMap:
    """Hann-windowed short-time spectra of `residual` (samples,) over the noise of `explanation`."""
    rate = explanation.fit.hypothesis.scale.rate
    window = min(max(len(residual) // WINDOWS, SHORTEST_WINDOW), len(residual))
    frequencies, times, density = spectrogram(
        residual, rate, "hann", nperseg=window, noverlap=3 * window // 4, detrend=False
    )
    kept = slice(1, -1)
    power = density[kept] * rate / 2
    floor = noise_power(explanation, frequencies[kept])[:, None]
    decibels = 10 * np.log10(np.maximum(power, 1e-30 * floor) / floor)
    return ResidualMap(times, frequencies[kept], np.asarray(decibels))
