"""Least trimmed squares: errors without the stretches of the records that fit worst.

Where an axis can move in two ways at one command, as on a spring that stiffens, the least difference decides
which, and the squared error of a right model is as large as that of a wrong one. Over the stretches that fit
best it is not (least trimmed squares: Rousseeuw, doi 10.1080/01621459.1984.10477105).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.gap.simulate.columns import mean_squares

STRETCHES = 24
"""Of every record."""


def best_stretches(white: Sequence[FloatArray], left_out: float) -> list[BoolArray]:
    """Where errors (samples, n), a record each, fit best: false in the share `left_out` of all stretches that
    have the largest mean squares, each column's own. All true in a column of which no share is finite."""
    bounds = [_bounds(len(e)) for e in white]
    sizes = [np.diff([*starts, len(e)]) for e, starts in zip(white, bounds, strict=True)]
    squares = [mean_squares(e, starts) for e, starts in zip(white, bounds, strict=True)]
    every = np.nan_to_num(np.concatenate(squares), nan=np.inf, posinf=np.inf)
    kept = max(round((1 - left_out) * len(every)), 1)
    largest = np.partition(every, kept - 1, axis=0)[kept - 1]
    ends = np.cumsum([len(s) for s in squares])[:-1]
    return [
        np.repeat(part <= largest, size, axis=0)
        for part, size in zip(np.split(every, ends), sizes, strict=True)
    ]


@lru_cache(maxsize=64)
def _bounds(samples: int) -> IntArray:
    """Where each stretch of a record begins."""
    bounds = np.unique(np.linspace(0, samples, min(STRETCHES, samples) + 1)[:-1].astype(np.int64))
    bounds.setflags(write=False)
    return bounds
