"""Poles of a linear system from input and output records, by subspace identification.

The past-outputs variant of MOESP, of the N4SID family (Verhaegen 1994, doi 10.1016/0005-1098(94)90229-1; Van
Overschee and De Moor 1994, doi 10.1016/0005-1098(94)90230-5): with past inputs and outputs as instruments,
the observability matrix of the deterministic part comes from an LQ factorization and a singular value
decomposition, consistently under coloured measurement noise. Several records enter as more columns of the
block Hankel matrices, so no record's start is joined to another's end.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray

CHUNK = 20_000
"""Columns of the block Hankel matrices that are factorized at a time."""


@dataclass(frozen=True, eq=False)
class ObservabilitySubspace:
    """The column space of the extended observability matrix.

    `directions` (block_rows, block_rows) are its left singular vectors and `singular_values` (block_rows,)
    their weights, in decreasing order.
    """

    directions: FloatArray
    singular_values: FloatArray

    def poles(self, order: int) -> ComplexArray:
        """Poles of the system of `order` states: eigenvalues of A from the shift invariance, (order,)."""
        observability = self.directions[:, :order] * np.sqrt(self.singular_values[:order])
        transition = np.linalg.lstsq(observability[:-1], observability[1:], rcond=None)[0]
        return np.asarray(np.linalg.eigvals(transition), dtype=np.complex128)


def observability_subspace(
    inputs: Sequence[FloatArray], outputs: Sequence[FloatArray], block_rows: int
) -> ObservabilitySubspace:
    """Factorize the data of all records; `inputs[i]` and `outputs[i]` have one length.

    `block_rows` must exceed the largest order asked for later. Records shorter than 4 `block_rows` are left
    out; with none left a ValueError says so.
    """
    triangle = np.zeros((0, 4 * block_rows))
    for u, y in zip(inputs, outputs, strict=True):
        columns = len(u) - 2 * block_rows + 1
        if columns <= 2 * block_rows:
            continue
        u_windows = np.lib.stride_tricks.sliding_window_view(u, 2 * block_rows)
        y_windows = np.lib.stride_tricks.sliding_window_view(y, 2 * block_rows)
        for first in range(0, columns, CHUNK):
            part = slice(first, min(first + CHUNK, columns))
            u_past, u_future = np.split(u_windows[part], 2, axis=1)
            y_past, y_future = np.split(y_windows[part], 2, axis=1)
            stacked = np.concatenate([u_future, u_past, y_past, y_future], axis=1)
            triangle = np.asarray(np.linalg.qr(np.concatenate([triangle, stacked]), mode="r"))
    if not len(triangle):
        raise ValueError(f"no record is longer than {4 * block_rows} samples")
    past = slice(block_rows, 3 * block_rows)
    projection = triangle[past, 3 * block_rows :].T
    directions, singular_values, _ = np.linalg.svd(projection, full_matrices=False)
    return ObservabilitySubspace(directions, singular_values)
