"""Names for the array types that public signatures use, stretches of a mask, peaks, and robust spreads."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
ComplexArray: TypeAlias = NDArray[np.complex128]
IntArray: TypeAlias = NDArray[np.int64]
BoolArray: TypeAlias = NDArray[np.bool_]


def stretches_of(mask: BoolArray) -> tuple[IntArray, IntArray]:
    """First samples of the stretches that a mask (samples,) marks, and one past their last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], mask.astype(np.int8), [0]])))
    return edges[::2], edges[1::2]


def robust_sigma(values: FloatArray) -> float:
    """Standard deviation of normal values about zero whose sizes have the median seen; NaN where all are NaN.

    1.4826 = 1 / Phi^-1(3 / 4) times the median of the absolute values; NaN are left out.
    """
    return 1.4826 * float(np.nanmedian(np.abs(values)))


def white_sigma(outputs: Sequence[FloatArray]) -> float:
    """Standard deviation of white noise whose third differences have the median seen (1 + 9 + 9 + 1 = 20
    times its variance); outputs are NaN where nothing was measured."""
    return robust_sigma(np.concatenate([np.diff(y, 3) for y in outputs])) / float(np.sqrt(20.0))


def spanned(rows: Sequence[FloatArray]) -> float:
    """From the smallest to the largest of all values of several rows."""
    return float(max(row.max() for row in rows) - min(row.min() for row in rows))


def highest_peaks(values: FloatArray) -> IntArray:
    """Where `values` (n,) have a local maximum, an end or a plateau too, the largest first."""
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    at = np.flatnonzero((values >= padded[:-2]) & (values >= padded[2:]))
    return at[np.argsort(-values[at], kind="stable")]
