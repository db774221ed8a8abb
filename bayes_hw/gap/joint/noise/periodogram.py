"""Periodograms of tapered first differences: of a walk there is no leakage from frequency zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray


def tapered_periodograms(residuals: Sequence[FloatArray], rate_hz: float) -> tuple[FloatArray, FloatArray]:
    """Frequencies (Hz) and powers (ordinates,) of the first differences of residuals, one record after the
    other. Hann tapering ties neighbours together: every second ordinate is kept."""
    frequencies, powers = [], []
    for e in residuals:
        d = np.diff(e)
        taper = np.hanning(len(d) + 2)[1:-1]
        transform = np.fft.rfft(d * taper) / np.sqrt(np.sum(taper**2))
        keep = slice(2, len(transform) - 2, 2)
        frequencies.append(np.fft.rfftfreq(len(d), 1 / rate_hz)[keep])
        powers.append(np.abs(transform[keep]) ** 2)
    return np.concatenate(frequencies), np.concatenate(powers)
