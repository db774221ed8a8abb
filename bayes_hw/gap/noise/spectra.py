"""Spectra of residuals, and models fitted to them by Whittle's likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import minimize

from bayes_hw.arrays import FloatArray

LARGEST_NOISE_CORRELATION = 0.92
"""First autocorrelation that encoder noise may have; what is slower is called wind or drift."""

BINS = 120

LINES = 4
LINE_WIDTH = 6
"""Bins within which two peaks are one line."""

NEARBY_SHARE = 40
"""Of a record: its spectrum's level is the median over this part of it to either side."""

LEAST_RATIO = 12.0
"""Power over the level from which a peak is a line; noise alone reaches 10 in the largest of many."""


@dataclass(frozen=True)
class Spectrum:
    """Mean periodogram of the residuals in bins: frequencies (Hz), power, number of ordinates averaged."""

    frequencies: FloatArray
    power: FloatArray
    counts: FloatArray


def mean_spectrum(residuals: Sequence[FloatArray], rate: float) -> Spectrum:
    """Tapered periodograms of all records averaged in bins of equal ratio; power a sample, output units^2."""
    frequency, power = [], []
    for e in residuals:
        taper = np.hanning(len(e) + 2)[1:-1]
        taper = taper / np.sqrt(np.mean(taper**2))
        transform = np.abs(np.fft.rfft(taper * (e - e.mean()))) ** 2 / len(e)
        frequency.append(np.fft.rfftfreq(len(e), 1 / rate)[1:])
        power.append(transform[1:])
    f, p = np.concatenate(frequency), np.concatenate(power)
    edges = np.unique(np.concatenate([np.geomspace(f.min(), f.max(), BINS), [f.max() * 1.0001]]))
    index = np.digitize(f, edges) - 1
    counts = np.bincount(index, minlength=len(edges)).astype(float)
    used = counts > 0
    mean = np.bincount(index, p, minlength=len(edges))[used] / counts[used]
    centre = np.bincount(index, f, minlength=len(edges))[used] / counts[used]
    return Spectrum(centre, mean, counts[used])


def first_order_spectrum(frequency: FloatArray, rate: float, sigma: float, correlation: float) -> FloatArray:
    """Power a sample of first-order noise with marginal `sigma` and first autocorrelation."""
    z = np.cos(2 * np.pi * frequency / rate)
    return sigma**2 * (1 - correlation**2) / (1 - 2 * correlation * z + correlation**2)


def whittle(spectrum: Spectrum, model: FloatArray) -> float:
    """Minus Whittle's log-likelihood of the binned spectrum, up to a constant."""
    return float(np.sum(spectrum.counts * (np.log(model) + spectrum.power / model)))


def fit_spectrum(spectrum: Spectrum, model, starts: Sequence[FloatArray]) -> FloatArray:  # type: ignore[no-untyped-def]
    """Parameters of `model(frequency, parameters)` of most Whittle likelihood, from several starts."""

    def cost(p: FloatArray) -> float:
        return whittle(spectrum, np.maximum(model(spectrum.frequencies, p), 1e-300))

    best = None
    options: Any = {"maxiter": 250, "xatol": 1e-3, "fatol": 0.05}
    for start in starts:
        found = minimize(cost, start, method="Nelder-Mead", options=options)
        if best is None or found.fun < best.fun:
            best = found
    assert best is not None
    return np.asarray(best.x)


def standing_out(residuals: Sequence[FloatArray], rate: float) -> FloatArray:
    """Up to LINES frequencies (Hz) where the power of the residuals is largest over its median nearby.

    Records are windowed (Hann) and cut to the length of the shortest; none where they are too short to tell.
    """
    samples = min(len(e) for e in residuals)
    window = np.hanning(samples)
    power = sum(np.abs(np.fft.rfft(window * (e[:samples] - e[:samples].mean()))) ** 2 for e in residuals)
    around = max(5, samples // NEARBY_SHARE)
    if samples < 8 * around:
        return np.empty(0)
    level = median_filter(power, 2 * around + 1, mode="nearest")
    ratio = np.where(level > 0, power / np.maximum(level, 1e-300), 0.0)
    ratio[: 2 * around // 5] = 0.0
    found: list[int] = []
    for i in np.argsort(-ratio):
        if len(found) == LINES or ratio[i] < LEAST_RATIO:
            break
        if all(abs(int(i) - other) > LINE_WIDTH for other in found):
            found.append(int(i))
    return np.array(found) * rate / samples
