"""The delay from command to output: the first lag at which the command moves the output.

Regressions of the output's increments,

    z(k) = a_1 z(k-1) + ... + a_n z(k-n) + b_0 v(k-d) + ... + b_n v(k-d-n) + e(k),

are weighed over all d and n by the Bayesian information criterion. A command held from sample to sample whose
first effect is seen after d samples was delayed by d - 1 to d of them: that much no sampled record tells.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.frequency_response import PROBABILITY

PAST = 12
ORDERS = (3, 6, 12)
LAGS = 40
MOST_SAMPLES = 30_000
RATE_HZ = 50.0
"""Faster records are averaged down to about this rate, below which the steps of a drive are slow."""


@dataclass(frozen=True)
class Delay:
    """Mean, standard deviation and 94 % interval in s; `step_s` is the period that they are read at."""

    mean: float
    sd: float
    low: float
    high: float
    step_s: float


def delay(
    outputs: Sequence[FloatArray],
    commands: Sequence[FloatArray],
    sample_rate_hz: float,
    seen: float = 1.0,
) -> Delay | None:
    """None where the records are too short, or the command never moves.

    `seen` is the share of the samples that tell of the motion, `Statics.seen`: of the others the criterion
    knows nothing, and it counts for its square.
    """
    factor = max(1, int(sample_rate_hz / RATE_HZ))
    step = factor / sample_rate_hz
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
    middles = (lags - 0.5).clip(0.5) * step
    mean = float(share @ middles)
    sd = float(np.sqrt(share @ (middles - mean) ** 2 + step**2 / 12))
    chosen = np.sort(
        np.argsort(share)[::-1][: int(np.searchsorted(np.sort(share)[::-1].cumsum(), PROBABILITY)) + 1]
    )
    low, high = max(float(chosen[0]) - 1, 0.0) * step, max(float(chosen[-1]), 1.0) * step
    return Delay(mean, sd, low, high, step)


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
