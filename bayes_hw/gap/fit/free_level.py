"""Levels of records whose angles count from one that was estimated: profiled by generalised least squares.

With a flat prior that is their integral, up to a constant (see `bayes_hw.identify.growth.levels`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.noise.whitener import Whitener


def white_level(hypothesis: Hypothesis, whitener: Whitener, record: int) -> FloatArray | None:
    """What a level of one is after whitening (samples,); None where the record's is known, or none of it
    counts."""
    if record not in hypothesis.free_levels:
        return None
    ones = np.ones((len(hypothesis.inputs[record]), 1))
    level = np.ascontiguousarray(whitener.whiten(ones, record)[:, 0])
    return level if level.any() else None


def without_level(hypothesis: Hypothesis, whitener: Whitener, white: FloatArray, record: int) -> FloatArray:
    """White columns (samples, n) of a record less what of them a free level explains."""
    level = white_level(hypothesis, whitener, record)
    if level is None:
        return white
    return np.ascontiguousarray(white - np.outer(level, level @ white / (level @ level)))


def level_of(hypothesis: Hypothesis, whitener: Whitener, errors: FloatArray, record: int) -> float:
    """The level of the errors (samples,) of a record; zero where it is known or they are beyond numbers."""
    level = white_level(hypothesis, whitener, record)
    if level is None:
        return 0.0
    found = float(level @ whitener.whiten(errors[:, None], record)[:, 0]) / float(level @ level)
    return found if np.isfinite(found) else 0.0


def level_columns(hypothesis: Hypothesis, whitener: Whitener, lengths: Sequence[int]) -> FloatArray:
    """White columns (samples of all records, levels), one for every free level."""
    begins = np.cumsum([0, *lengths])
    found = []
    for record in hypothesis.free_levels:
        level = white_level(hypothesis, whitener, record)
        if level is not None:
            found.append(np.zeros(begins[-1]))
            found[-1][begins[record] : begins[record + 1]] = level
    return np.stack(found, axis=1) if found else np.empty((begins[-1], 0))
