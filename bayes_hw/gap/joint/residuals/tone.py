"""A motion of one frequency in time, whatever is commanded: a pump, a compressor, another drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import median_filter
from scipy.optimize import minimize_scalar

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.identify.holes import without_holes

PADDED = 4
"""Points of the scan per resolvable frequency."""

FEWEST_CYCLES = 3.0
"""In the longest record."""

BACKGROUND = 81
"""Points of the running median that a line is held against."""

PROMISING_NATS, MOST_LINES = 30.0, 2


@dataclass(frozen=True, eq=False)
class Tone:
    """A line of `frequency_hz` with its `amplitude` (root mean square over the records times sqrt 2, output
    units), and the best cascade `without` it."""

    frequency_hz: float
    amplitude: float
    without: JointFit


def tone_in(fit: JointFit) -> Tone | None:
    """The line whose removal helps `fit` most; None where none stands out.

    Its phase and amplitude are free in every record, so that no clock need be shared.
    """
    rate = fit.response.scale.rate_hz
    found = [without_line(fit, f * rate) for f in _lines([without_holes(e) for e in fit.point.residuals])]
    return max(found, key=lambda tone: tone.without.score, default=None)


def _lines(residuals: Sequence[FloatArray]) -> list[float]:
    """Frequencies (cycles a sample) of the strongest lines over the continuous spectrum."""
    longest = max(len(e) for e in residuals)
    points = PADDED * longest
    power = np.zeros(points // 2 + 1)
    for e in residuals:
        taper = np.hanning(len(e) + 2)[1:-1]
        spectrum = np.abs(np.fft.rfft(e * taper, points)) ** 2
        background = median_filter(spectrum, BACKGROUND, mode="nearest") / np.log(2)
        power += spectrum / np.maximum(background, np.finfo(float).tiny)
    frequencies = np.fft.rfftfreq(points)
    power[frequencies < FEWEST_CYCLES / longest] = 0.0
    lines: list[float] = []
    for _ in range(MOST_LINES):
        i = int(np.argmax(power))
        if power[i] < PROMISING_NATS:
            break
        lines.append(float(frequencies[i]))
        power[max(i - 2 * PADDED, 0) : i + 2 * PADDED + 1] = 0.0
    return lines


def without_line(fit: JointFit, frequency_hz: float) -> Tone:
    """The line next to a frequency taken out of the records of `fit`, and `fit` descended without it."""
    residuals = [without_holes(e) for e in fit.point.residuals]
    longest = max(len(e) for e in residuals)
    rate = fit.response.scale.rate_hz
    frequency = frequency_hz / rate

    def waves(f: float) -> list[FloatArray]:
        return [_projected(e, f) for e in residuals]

    def left(f: float) -> float:
        return sum(float(np.sum((e - s) ** 2)) for e, s in zip(residuals, waves(f), strict=True))

    width = 1.0 / (PADDED * longest)
    best = float(minimize_scalar(left, bounds=(frequency - width, frequency + width), method="bounded").x)
    taken = waves(best)
    records = [replace(record, y=record.y - s) for record, s in zip(fit.response.records, taken, strict=True)]
    without = fit.under(replace(fit.response, records=records))
    without = replace(without, taken=fit.taken + 2 * len(records) + 1).descended()
    amplitude = float(np.sqrt(2 * np.mean(np.concatenate(taken) ** 2)))
    return Tone(best * rate, amplitude, without)


def _projected(e: FloatArray, frequency: float) -> FloatArray:
    """The part of `e` (samples,) that a sine of this frequency explains, about its level and slope."""
    k = np.arange(len(e))
    angle = 2 * np.pi * frequency * k
    basis = np.stack([np.cos(angle), np.sin(angle), np.ones(len(e)), k / len(e)], axis=1)
    weights = np.linalg.lstsq(basis, e, rcond=None)[0]
    return np.asarray(basis[:, :2] @ weights[:2], dtype=np.float64)
