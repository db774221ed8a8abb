"""Whether what is left is the same at all times: noise with a rhythm of samples."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import kurtosis

from bayes_hw.arrays import FloatArray

LONGEST_RHYTHM = 12


def rhythm_nats(innovations: Sequence[FloatArray]) -> float:
    """What a variance of its own for every sample number modulo m gains, at the best m.

    Squares of heavy-tailed noise scatter more than those of normal noise, and the ratio of likelihoods with
    them: it is divided by one and half of the excess kurtosis (Layard, 1973, doi 10.2307/2284766).
    """
    best = -np.inf
    whole = np.concatenate(list(innovations))
    tails = max(float(kurtosis(whole)), 0.0) if len(whole) > 3 and np.ptp(whole) > 0 else 0.0
    for m in range(2, LONGEST_RHYTHM + 1):
        best = max(best, _gained([np.concatenate([a[i::m] for a in innovations]) for i in range(m)]))
    return best / (1 + tails / 2)


def _gained(parts: Sequence[FloatArray]) -> float:
    """Less what normal noise of one variance would gain on average, and half a logarithm of the samples."""
    whole = np.concatenate(list(parts))
    tiny = float(np.finfo(float).tiny)
    apart = sum(len(p) * float(np.log(np.mean(p**2) + tiny)) for p in parts if len(p))
    together = len(whole) * float(np.log(np.mean(whole**2) + tiny))
    return 0.5 * (together - apart) - 0.5 * (len(parts) - 1) - 0.5 * float(np.log(max(len(whole), 2)))
