"""Readings that are worse at every m-th sample, as of a converter or an interpolation that takes turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.gap.joint.residuals.speed_noise import less_for_tails

LONGEST_RHYTHM = 12
"""Samples after which it repeats, at most."""

PRESENT_NATS = 20.0
"""From which a rhythm is there."""


@dataclass(frozen=True, eq=False)
class Rhythm:
    """After how many samples it repeats, the nats of it, and deviations (every,) of the samples by number
    modulo that, over the least of them."""

    every: int
    nats: float
    deviations: FloatArray

    @property
    def present(self) -> bool:
        return self.nats > PRESENT_NATS

    def weights(self, samples: int) -> FloatArray:
        """Deviations (samples,) of a record, the least of them one."""
        return np.resize(self.deviations, samples)


def rhythm(errors: Sequence[FloatArray], masks: Sequence[BoolArray]) -> Rhythm:
    """What a variance of its own for every sample number modulo m gains, at the best m, of errors or
    innovations (samples,) of records where a mask (samples,) says that they count.

    Heavy tails make such gains larger, and nats are divided by what they do (`less_for_tails`).
    """
    whole = np.concatenate([e[mask] for e, mask in zip(errors, masks, strict=True)])
    numbers = np.concatenate([np.flatnonzero(mask) for mask in masks])
    best = max((_at_every(m, whole, numbers) for m in range(2, LONGEST_RHYTHM + 1)), key=lambda r: r.nats)
    return replace(best, nats=less_for_tails(best.nats, whole))


def _at_every(m: int, errors: FloatArray, numbers: IntArray) -> Rhythm:
    """At one m, less half a logarithm of the samples for every variance but one. Samples of which none counts
    are taken to be as good as the best."""
    tiny = float(np.finfo(float).tiny)
    counts = np.bincount(numbers % m, minlength=m)
    variances = np.bincount(numbers % m, errors**2, m) / np.maximum(counts, 1) + tiny
    together = len(errors) * float(np.log(np.mean(errors**2) + tiny)) if len(errors) else 0.0
    gained = 0.5 * (together - float(counts @ np.log(variances)))
    price = 0.5 * (m - 1) * float(np.log(max(len(errors), 2)))
    least = np.min(variances, where=counts > 0, initial=np.inf)
    return Rhythm(m, gained - price, np.sqrt(np.where(counts > 0, variances / least, 1.0)))
