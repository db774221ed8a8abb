"""Error by direction of motion: what play and friction leave at every reversal.

The mean error of the later half of a stroke, from one reversal to the next, is compared with that of the
stroke before it. Half their difference is h for hysteresis and proportional to the speed for a lag:

    half difference(j) = h + lag * mean |speed|(j) + scatter(j),

fitted over all pairs of neighbouring strokes. Neighbouring pairs share a stroke and so correlate by a half at
most, which at most doubles the variance of what is fitted: it counts as doubled.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np
from scipy import special

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.first_look.frequency_response import PROBABILITY

LEAST_STROKE_S = 1.0
"""Shorter strokes tell of dynamics."""

FEWEST = 6
"""Reversals from which hysteresis is told."""

SPEEDS, CLEAR_SPEEDS = 1.25, 1.5
"""Largest speed of a stroke over the smallest, from which a lag is told from hysteresis; and from which a
lag that is not quite proportional to the speed is."""

LEVEL = 1e-6
"""Probability of calling something hysteresis that is none."""


THRESHOLD = 8.0
"""Noise levels that the motion goes back to be a reversal."""


@dataclass(frozen=True)
class Hysteresis:
    """The error's part that changes sign with the direction of motion, output units: `half_width`, negative
    where the angle stays behind, its standard error, over how many reversals, and the largest speed of
    their strokes over the smallest."""

    half_width: float
    standard_error: float
    reversals: int
    speeds: float

    @property
    def is_clear(self) -> bool:
        """Whether the angle stays behind, by more than scatter makes, over speeds that differ."""
        scatter = _quantile(1 - LEVEL, self.reversals) * self.standard_error
        return self.speeds > CLEAR_SPEEDS and -self.half_width > scatter

    @property
    def bound(self) -> float:
        """What it does not exceed, at 94 %."""
        return abs(self.half_width) + _quantile(PROBABILITY, self.reversals) * self.standard_error

    def to_dict(self) -> dict[str, float | int | bool]:
        """As in look.json."""
        return asdict(self) | {"is_clear": self.is_clear}


def _quantile(probability: float, reversals: int) -> float:
    return float(special.stdtrit(reversals - 2, probability))


def directions(motion: FloatArray, threshold: float) -> IntArray:
    """1 or -1 by the last motion that went on by half the threshold or back by the whole; 0 before any."""
    found, centre, direction, half = [0] * len(motion), float(motion[0]), 0, threshold / 2
    for k, value in enumerate(motion.tolist()):
        if value - centre > half:
            centre, direction = value - half, 1
        elif centre - value > half:
            centre, direction = value + half, -1
        found[k] = direction
    return np.array(found, dtype=np.int64)


def hysteresis(
    motions: Sequence[FloatArray], errors: Sequence[FloatArray], sample_rate_hz: float, noise_sigma: float
) -> Hysteresis | None:
    """From the angles as simulated and the errors, per record; None where reversals are few, or all strokes
    as fast as each other.
    """
    rows: list[tuple[float, float]] = []
    for motion, error in zip(motions, errors, strict=True):
        rows += _contrasts(directions(motion, THRESHOLD * noise_sigma), motion, error, sample_rate_hz)
    if len(rows) < FEWEST:
        return None
    contrast, speed = np.array(rows).T
    if not speed.max() > SPEEDS * speed.min():
        return None
    table = np.column_stack([np.ones(len(rows)), speed / speed.max()])
    inverse = np.linalg.inv(table.T @ table)
    fitted = inverse @ table.T @ contrast
    left = contrast - table @ fitted
    variance = 2 * float(left @ left) / (len(rows) - 2)
    standard_error = float(np.sqrt(variance * inverse[0, 0]))
    least = max(float(speed.min()), 1e-9 * float(speed.max()))
    return Hysteresis(float(fitted[0]), standard_error, len(rows), float(speed.max()) / least)


def _contrasts(
    direction: IntArray, motion: FloatArray, error: FloatArray, sample_rate_hz: float
) -> list[tuple[float, float]]:
    """Half the change of the error and the mean speed, of every two neighbouring strokes that are long."""
    speed = np.abs(np.gradient(motion)) * sample_rate_hz
    edges = np.flatnonzero(np.diff(direction, prepend=2, append=2))
    found, before = [], None
    for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        if direction[start] == 0 or stop - start < LEAST_STROKE_S * sample_rate_hz:
            before = None
            continue
        middle = (start + stop) // 2
        now = (float(error[middle:stop].mean()), float(speed[middle:stop].mean()))
        if before is not None:
            change = float(direction[start]) * (now[0] - before[0]) / 2
            found.append((change, (now[1] + before[1]) / 2))
        before = now
    return found
