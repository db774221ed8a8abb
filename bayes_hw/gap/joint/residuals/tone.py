"""A motion of one frequency in time, whatever is commanded: a pump, a compressor, another drive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg
from scipy.ndimage import median_filter
from scipy.optimize import minimize_scalar

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.identify.holes import without_holes
from bayes_hw.record import Record
from bayes_hw.time_budget import time_is_up

PADDED = 4
"""Points of the scan per resolvable frequency."""

FEWEST_CYCLES = 3.0
"""In the longest record."""

BACKGROUND = 81
"""Points of the running median that a line is held against."""

PROMISING_NATS, MOST_LINES = 30.0, 2
MOST_ROUNDS, SMALL_NATS = 5, 2.0
"""In which a line is taken out again beside what is left without it, as long as that gains as much."""


@dataclass(frozen=True, eq=False)
class Tone:
    """A line of `frequency_hz` with its `amplitude` (root mean square over the records times sqrt 2, output
    units), and the best cascade `without` it."""

    frequency_hz: float
    amplitude: float
    without: JointFit


def tone_in(fit: JointFit) -> Tone | None:
    """The line whose removal helps `fit` most; None where none stands out, or where time is up.

    Its phase and amplitude are free in every record, so that no clock need be shared.
    """
    if time_is_up():
        return None
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
    """The line next to a frequency taken out of the records of `fit`, and `fit` descended without it: what
    the encoder shows, or the axis as it moves, which its dead zone hides, whichever is likelier."""
    ways = [_without(fit, frequency_hz, moves) for moves in (False, True)]
    return max(ways, key=lambda tone: tone.without.score)


def _without(fit: JointFit, frequency_hz: float, moves: bool) -> Tone:
    """The line in rounds, as long as taking it out anew makes what is left likelier; what the axis moves
    shows in proportion to the slope of its output."""
    rate, records = fit.response.scale.rate_hz, fit.response.records
    best = Tone(frequency_hz, 0.0, fit)
    for number in range(MOST_ROUNDS):
        frequency, taken = _line(best.without, records, best.frequency_hz / rate, moves)
        quiet = [replace(r, y=r.y - line) for r, line in zip(records, taken, strict=True)]
        without = best.without.under(replace(fit.response, records=quiet))
        without = replace(without, taken=fit.taken + 2 * len(records) + 1).descended()
        if number and without.score < best.without.score + SMALL_NATS:
            break
        amplitude = float(np.sqrt(2 * np.mean(np.concatenate(taken) ** 2)))
        best = Tone(frequency * rate, amplitude, without)
    return best


def _line(
    fit: JointFit, records: Sequence[Record], frequency: float, moves: bool
) -> tuple[float, list[FloatArray]]:
    """The frequency (cycles a sample) near the given one of the line that `fit` leaves of the records, and
    the line (samples,) of each: by least squares beside the fit's own coordinates, a level and a slope."""
    runs = [fit.response.along(fit.values, i) for i in range(len(records))]
    shown = [run.slope if moves else np.ones(len(r)) for run, r in zip(runs, records, strict=True)]
    weights = fit.response.weights or tuple(np.ones(len(r)) for r in records)
    errors = np.concatenate([without_holes(r.y_or_nan - run.y) for r, run in zip(records, runs, strict=True)])
    slopes = np.concatenate(
        [
            rows[:-1].T * w[:, None]
            for (rows, _, _), w in zip(fit.response.linearise(fit.point.coordinates, 0), weights, strict=True)
        ]
    )
    ends = np.cumsum([len(r) for r in records])[:-1]

    def of_records(columns: Sequence[FloatArray]) -> FloatArray:
        return linalg.block_diag(*columns)

    trends = of_records([np.stack([np.ones(len(r)), np.arange(len(r)) / len(r)], axis=1) for r in records])
    beside = linalg.qr(_unit(np.concatenate([slopes, trends], axis=1)), mode="economic")[0]

    def waves(f: float) -> FloatArray:
        angles = [2 * np.pi * f * np.arange(len(r)) for r in records]
        return of_records(
            [np.stack([np.cos(a) * s, np.sin(a) * s], axis=1) for a, s in zip(angles, shown, strict=True)]
        )

    def solved(f: float) -> tuple[FloatArray, float]:
        outside = waves(f)
        outside = outside - beside @ (beside.T @ outside)
        weight = linalg.lstsq(outside, left)[0]
        return weight, float(np.sum((left - outside @ weight) ** 2))

    left = errors - beside @ (beside.T @ errors)
    width = 1.0 / (PADDED * max(len(r) for r in records))
    bounds = (frequency - width, frequency + width)
    best = float(minimize_scalar(lambda f: solved(f)[1], bounds=bounds, method="bounded").x)
    return best, np.split(waves(best) @ solved(best)[0], ends)


def _unit(columns: FloatArray) -> FloatArray:
    """Columns of length one, those of none left out."""
    norms = np.linalg.norm(columns, axis=0)
    return np.asarray(columns[:, norms > 0] / norms[norms > 0])
