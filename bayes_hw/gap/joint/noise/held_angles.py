"""Angles that are held for some samples, read with fresh noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray, robust_sigma
from bayes_hw.gap.joint.noise.reading_faults import running_median

LEAST_NATS, ROUNDS, FAR = 60.0, 40, 10.0
"""What held angles must gain; rounds of expectation and maximisation; spread of readings that are far off for
any other reason, over the usual one."""

EITHER_WAY = 1.5
"""Times what offsets along the motion gain, that those against it must: a fit lags by the mean of what is
held, beside which other samples are ahead."""

STRETCH, CHANCE = 25, 0.5
"""Samples that share a lag, and the nats that a number gains by chance."""

LONGEST_HELD, MEDIAN_ROUNDS = 12, 3
"""Samples for which an angle is held at most; rounds in which what is slow is told beside what is held."""


@dataclass(frozen=True, eq=False)
class HeldAngles:
    """Masks (samples,) of every record where an angle was more likely held than not, the share of all samples
    that were held, and the nats of that."""

    masks: tuple[BoolArray, ...]
    share: float
    nats: float

    @property
    def present(self) -> bool:
        return self.nats > LEAST_NATS


def held_angles(residuals: Sequence[FloatArray], angles: Sequence[FloatArray], noise: float) -> HeldAngles:
    """Samples that show an angle of up to LONGEST_HELD samples before under noise of their own: their
    residual departs from that of their neighbours by the step of `angles` to them, against the motion.

    A mixture of usual readings, held ones, and FAR ones with shares of maximal likelihood, every sample that
    is held as likely to be followed by another one; nats are over one without held ones, of the residuals or
    of what a lag that differs from STRETCH to stretch leaves of them, as a model that lags does; less
    EITHER_WAY times what steps along the motion gain, as those of odd instants do.
    """
    behind = np.concatenate([_steps_back(angle) for angle in angles], axis=1)
    without, _ = _beside_slow(residuals, behind[:0], noise)
    against, held = _beside_slow(residuals, behind, noise)
    if against - without > LEAST_NATS:
        unlagged, lags = _without_lags(residuals, angles)
        without = max(without, _beside_slow(unlagged, behind[:0], noise)[0] - CHANCE * lags)
    nats = against - without
    if nats > LEAST_NATS:
        along, _ = _beside_slow(residuals, -behind, noise)
        nats -= EITHER_WAY * max(along - without, 0.0)
    masks = tuple(np.split(held > 0.5, _ends(residuals)))
    return HeldAngles(masks, float(np.mean(held)), nats)


def _beside_slow(
    residuals: Sequence[FloatArray], offsets: FloatArray, noise: float
) -> tuple[float, FloatArray]:
    """Log-likelihood of departures from what is slow, of which some are one of `offsets` (kinds, samples) and
    some FAR, and how likely each sample is an offset one (samples,)."""
    e = np.concatenate(list(residuals))
    expected = np.zeros_like(e)
    for _ in range(MEDIAN_ROUNDS):
        slow = np.concatenate([running_median(one) for one in np.split(e - expected, _ends(residuals))])
        usual = max(robust_sigma(e - expected - slow), noise, float(np.finfo(float).tiny))
        d = (e - slow) / usual
        plain, far = np.exp(-0.5 * d**2), np.exp(-0.5 * (d / FAR) ** 2) / FAR
        total, held = _mixture(plain, far, np.exp(-0.5 * (d - offsets / usual) ** 2))
        expected = np.sum(held * offsets, axis=0)
    return total - len(e) * float(np.log(usual)), np.sum(held, axis=0)


def _without_lags(
    residuals: Sequence[FloatArray], angles: Sequence[FloatArray]
) -> tuple[list[FloatArray], int]:
    """Residuals (samples,) less the multiple of the angle's steps that leaves the least of every STRETCH, and
    how many multiples those are."""
    found, count = [], 0
    for e, angle in zip(residuals, angles, strict=True):
        step = np.diff(angle, prepend=angle[:1])
        starts = np.arange(0, len(e), STRETCH)
        squares = np.add.reduceat(step**2, starts)
        lag = np.add.reduceat(step * e, starts) / np.where(squares > 0, squares, 1.0)
        found.append(e - np.repeat(lag, np.diff(starts, append=len(e))) * step)
        count += len(starts)
    return found, count


def _ends(residuals: Sequence[FloatArray]) -> IntArray:
    """Where all records but the last end among all samples."""
    return np.cumsum([len(one) for one in residuals])[:-1]


def _steps_back(angle: FloatArray) -> FloatArray:
    """An angle (samples,) of 1, 2, ... samples before less that of each sample (LONGEST_HELD, samples)."""
    before = [np.concatenate([np.full(k, angle[0]), angle[:-k]]) for k in range(1, LONGEST_HELD + 1)]
    return np.stack(before) - angle


def _mixture(usual: FloatArray, far: FloatArray, held: FloatArray) -> tuple[float, FloatArray]:
    """Log-likelihood of a mixture of densities (samples,) at its likeliest shares, and what of every sample
    belongs to each of those that are `held` (kinds, samples): the second falls short of the first by the
    share by which the third does of the second."""
    stacked = np.stack([usual, far, *held]) + np.finfo(float).tiny
    shares = np.full((len(stacked), 1), 1 / len(stacked))
    longer = np.arange(len(held))
    for _ in range(ROUNDS):
        parts = shares * stacked / np.sum(shares * stacked, axis=0)
        shares = np.mean(parts, axis=1, keepdims=True)
        if len(held):
            whole = float(np.sum(shares[2:]))
            further = float(longer @ shares[2:, 0])
            falling = (further / max(whole + further, float(np.finfo(float).tiny))) ** longer
            shares[2:, 0] = whole * falling / np.sum(falling)
    return float(np.sum(np.log(np.sum(shares * stacked, axis=0)))), parts[2:]
