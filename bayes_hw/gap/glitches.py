"""Isolated samples far off their neighbours: encoder glitches."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.whitener import no_glitches

FAR = 6.0
"""Robust standard deviations off the neighbours' median."""

LARGEST_SHARE = 0.06
"""A larger share of far samples is no glitches but another distribution."""


def find_glitches(residuals: Sequence[FloatArray]) -> list[BoolArray]:
    """A mask (samples,) a record of the samples that stand alone, none where there are too many of them."""
    departures = []
    for e in residuals:
        padded = np.pad(e, 2, mode="reflect")
        neighbours = np.stack([padded[:-4], padded[1:-3], padded[3:-1], padded[4:]])
        departures.append(e - np.median(neighbours, axis=0))
    every = np.abs(np.concatenate(departures))
    robust = 1.4826 * float(np.median(every))
    masks = [np.abs(d) > FAR * robust for d in departures]
    share = sum(int(mask.sum()) for mask in masks) / len(every)
    if robust == 0 or share > LARGEST_SHARE:
        return no_glitches(residuals)
    return masks
