"""Names for the array types that public signatures use, and the stretches of a mask."""

from __future__ import annotations

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


def highest_peaks(values: FloatArray) -> IntArray:
    """Where `values` (n,) have a local maximum, an end or a plateau too, the largest first."""
    padded = np.concatenate([[-np.inf], values, [-np.inf]])
    at = np.flatnonzero((values >= padded[:-2]) & (values >= padded[2:]))
    return at[np.argsort(-values[at], kind="stable")]
