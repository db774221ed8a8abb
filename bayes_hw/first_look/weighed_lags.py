"""The lag at which a command first moves the output, weighed by what predicts best.

Regressions of the output's increments,

    z(k) = a_1 z(k-1) + ... + a_n z(k-n) + b_0 v(k-d) + ... + b_n v(k-d-n) + e(k),

are weighed over all d and n by the Bayesian information criterion. A command held from sample to sample whose
first effect is seen after d samples was delayed by d - 1 to d of them: that much no sampled record tells.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.frequency_response import PROBABILITY

PAST = 12
ORDERS = (3, 6, 12)
LAGS = 40
MOST_SAMPLES = 30_000


def weighed_lags(
    outputs: Sequence[FloatArray], commands: Sequence[FloatArray], factor: int, seen: float = 1.0
) -> tuple[float, float] | None:
    """Least and largest delay at 94 %, in samples of records averaged down by `factor`; None where the
    records are too short, or the command never moves.

    `seen` is the share of the samples that tell of the motion, `Statics.seen`: of the others the criterion
    knows nothing, and it counts for its square.
    """
    size = 1 + PAST + LAGS + 2
    gram, rows, left = np.zeros((size, size)), 0, MOST_SAMPLES
    for y, u in zip(outputs, commands, strict=True):
        length = min(len(y) // factor, left)
        if length < size:
            continue
        left -= length
        v = u[: length * factor].reshape(-1, factor).mean(axis=1)
        z = np.diff(y[: length * factor : factor], prepend=y[0])
        longest = max(PAST, LAGS)
        own = sliding_window_view(z, PAST + 1)[longest - PAST :, ::-1]
        driven = sliding_window_view(v, LAGS + 1)[longest - LAGS :, ::-1]
        table = np.concatenate([own, driven, np.ones((len(own), 1))], axis=1)
        gram += table.T @ table
        rows += len(table)
    if rows < 2 * size or not gram[1 + PAST, 1 + PAST] > 0:
        return None
    lags = np.arange(LAGS - max(ORDERS))
    score = np.array([[_criterion(gram, rows, int(d), n) for n in ORDERS] for d in lags])
    share = np.exp(-0.5 * seen**2 * (score - score.min())).sum(axis=1)
    share /= share.sum()
    chosen = np.sort(
        np.argsort(share)[::-1][: int(np.searchsorted(np.sort(share)[::-1].cumsum(), PROBABILITY)) + 1]
    )
    return max(float(chosen[0]) - 1, 0.0), max(float(chosen[-1]), 1.0)


def _criterion(gram: FloatArray, rows: int, lag: int, order: int) -> float:
    driven = 1 + PAST + lag
    chosen = np.r_[1 : 1 + order, driven : driven + order + 1, len(gram) - 1]
    inner, cross = gram[np.ix_(chosen, chosen)], gram[chosen, 0]
    scale = np.sqrt(np.maximum(np.diag(inner), np.finfo(float).tiny))
    inner = inner / np.outer(scale, scale) + 1e-10 * np.eye(len(chosen))
    cross = cross / scale
    squares = float(gram[0, 0] - cross @ linalg.solve(inner, cross, assume_a="pos"))
    squares = max(squares, 1e-14 * float(gram[0, 0]), np.finfo(float).tiny)
    return rows * float(np.log(squares / rows)) + len(chosen) * float(np.log(rows))
