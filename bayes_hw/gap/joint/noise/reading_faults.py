"""What the readings themselves show, whatever the axis does: rounding, repeats, glitches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, robust_sigma
from bayes_hw.record import Record

LATTICE_TOLERANCE = 1e-3
"""Of the step: readings this far from multiples of it are not rounded to it."""

REPEAT_SHARE = 0.004
"""Of the samples that repeat the one before beyond what chance has."""

STEP_LEVELS = (2.0, 40.0)
"""Shortest and longest step of rounding that noise was added to, over the innovations' deviation."""

SAWTOOTH = (0.6, 1.3)
"""Amplitude of the first harmonic over that of rounding; errors of the simulated angle blunt it."""

ROUNDED_NATS, MOVING_SHARE = 80.0, 0.02
BINS_OF_A_STEP, REFINED, LONGEST_SPECTRUM = 16, 8, 2**19

SURPRISE, UNLIKELY = 5.0, 1e-4
"""Standard deviations of a count beyond chance; chance of one repeat below which it is no chance."""

GLITCH_LEVELS = 6.0
FEWEST_GLITCHES = 6
ISOLATED_SHARE = 0.6
MASK = np.inf
"""Weight by which the residual of a sample that tells nothing is divided: it counts as not measured."""


def rounding_step(records: Sequence[Record]) -> float | None:
    """The step to which readings are rounded, output units; None where there is none."""
    steps = np.abs(np.concatenate([np.diff(record.y_or_nan) for record in records]))
    positive = steps[steps > 0]
    if not len(positive):
        return None
    step = float(positive.min())
    # The smallest difference carries the rounding of the file; the mean of many steps does not.
    usual = np.round(positive / step)
    near = usual <= 20
    step = float(np.mean(positive[near] / usual[near]))
    multiples = np.concatenate([record.y[record.measured_samples] for record in records]) / step
    off = np.abs(multiples - np.round(multiples))
    return step if np.quantile(off, 0.99) < LATTICE_TOLERANCE * 50 else None


@dataclass(frozen=True)
class RoundedMotion:
    """Rounding that noise was added to: its step, output units, and the nats of its first harmonic."""

    step: float
    nats: float


def rounded_motion(
    residuals: Sequence[FloatArray], angles: Sequence[FloatArray], noise: float
) -> RoundedMotion | None:
    """Of residuals that repeat with the angle that was simulated as rounding does; None where none does.

    Rounding to a step adds a sawtooth of the angle, whose first harmonic has the amplitude step / pi. The
    spectrum over the angle is that of the residuals sorted into bins of it; samples at rest tell nothing.
    Nats are over white noise, or over the usual power of longer and shorter steps where that is more.
    """
    speed = [np.abs(np.gradient(angle)) for angle in angles]
    usual = np.sqrt(np.mean(np.concatenate(speed) ** 2))
    moving = np.concatenate(speed) > MOVING_SHARE * usual
    angle, errors = np.concatenate(list(angles))[moving], np.concatenate(list(residuals))[moving]
    shortest, longest = (levels * noise for levels in STEP_LEVELS)
    width = shortest / BINS_OF_A_STEP
    if not len(angle) or not 2 * longest < np.ptp(angle) < LONGEST_SPECTRUM * width:
        return None
    errors = errors - np.mean(errors)
    binned = np.bincount(((angle - angle.min()) / width).astype(int), weights=errors)
    spectrum = np.abs(np.fft.rfft(binned, REFINED * len(binned)))
    frequency = np.arange(len(spectrum)) / (REFINED * len(binned) * width)
    sought = (frequency >= 1 / longest) & (frequency <= 1 / shortest)
    usual_power = max(
        float(np.median(spectrum[sought] ** 2)) / np.log(2), len(errors) * float(np.var(errors))
    )
    spectrum[~sought] = 0.0
    best = int(np.argmax(spectrum))
    step = float(1 / frequency[best])
    amplitude = 2 * float(spectrum[best]) / len(errors)
    tried = float(np.ptp(angle)) * (1 / shortest - 1 / longest)
    nats = float(spectrum[best] ** 2 / usual_power - np.log(tried))
    low, high = (share * step / np.pi for share in SAWTOOTH)
    return RoundedMotion(step, nats) if nats > ROUNDED_NATS and low < amplitude < high else None


def repeats(y: FloatArray, speed: FloatArray, noise: float) -> BoolArray:
    """Samples (samples,) that show the reading before although chance would hardly have it: the angle moves
    by `speed` (simulated step of every sample), the noise changes it, and the file tells such a change.

    Where the chance is r / (s sqrt(2 pi)) exp(-speed^2 / 2 s^2), with r the smallest step in the file and
    s = sqrt(2) noise, counts many more than it says, all repeats are of readings that were held.
    """
    steps = np.abs(np.diff(y))
    same = np.concatenate([[False], steps == 0])
    told = float(np.min(steps[steps > 0], initial=np.inf))
    spread = np.sqrt(2) * max(noise, float(np.finfo(float).tiny))
    chance = np.minimum(told / (spread * np.sqrt(2 * np.pi)), 1.0) * np.exp(-0.5 * (speed / spread) ** 2)
    expected = float(np.sum(chance))
    many = np.sum(same) > expected + SURPRISE * np.sqrt(expected) + REPEAT_SHARE * len(y)
    return same & (many | (chance < UNLIKELY))


@dataclass(frozen=True, eq=False)
class Glitches:
    """Masks (samples,) of every record, their number, the share that is isolated and the nats that they
    would cost a normal distribution."""

    masks: tuple[BoolArray, ...]
    count: int
    isolated: float
    nats: float

    @property
    def present(self) -> bool:
        return self.count >= FEWEST_GLITCHES and self.isolated >= ISOLATED_SHARE


def glitches(residuals: Sequence[FloatArray], least: float = 0.0) -> Glitches:
    """Samples whose residual departs from the median of its neighbours by more than GLITCH_LEVELS, of the
    usual departure or of the `least` that it may be taken for."""
    departures = [e - running_median(e) for e in residuals]
    level = robust_sigma(np.concatenate(departures))
    level = max(level, least, float(np.finfo(float).tiny))
    masks, isolated, nats = [], 0, 0.0
    for d in departures:
        mask = np.abs(d) > GLITCH_LEVELS * level
        quiet = np.abs(d) < GLITCH_LEVELS / 2 * level
        before, after = np.roll(quiet, 1), np.roll(quiet, -1)
        isolated += int(np.sum(mask & before & after))
        nats += float(np.sum(0.5 * (d[mask] / level) ** 2 - np.log(len(d))))
        masks.append(mask)
    count = int(sum(mask.sum() for mask in masks))
    return Glitches(tuple(masks), count, isolated / max(count, 1), nats)


def running_median(e: FloatArray) -> FloatArray:
    padded = np.concatenate([e[2:0:-1], e, e[-2:-4:-1]])
    others = np.stack([padded[i : i + len(e)] for i in (0, 1, 3, 4)])
    return np.asarray(np.median(others, axis=0), dtype=np.float64)
