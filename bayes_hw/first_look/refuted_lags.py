"""The lag at which a command first moves the output, by what is refuted.

The output's increments are those of the command's recent past beside coloured noise,

    z(k) = b_0 v(k) + b_1 v(k-1) + ... + b_L v(k-L) + slower lags of v + e(k),    e autoregressive,

fitted by generalised least squares. That b_0, ..., b_{d-1} are all zero is tested for every d in turn by the
score of the fit without them, whose covariance is summed over blocks of time: it holds whatever colours the
noise and whatever else the model lacks (White 1982, doi 10.2307/1912526). The smallest d that is refuted is
where the axis is seen to move at the latest: the delay is below it. A command held from sample to sample
whose first effect is seen after d samples was delayed d - 1 to d of them.

How much earlier it began is not seen where the motion begins slowly: a response that rises as a power of time
was below what is seen for as long as the highest power in question, `SLOWEST_RISE`, says.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg, special

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import autoregression_from_partial, burg, whitened

LEVEL = 0.03
"""Probability of a delay beyond what is given, half of what 94 % leaves."""

LAGS, MOST_LAGS = 40, 20
"""Lags of the command, and the first of them that are refuted in turn."""

TAILS = (40.0, 120.0, 400.0)
"""Time constants, in samples, of the slower lags."""

NOISE_ORDER = 12
ROUNDS = 3
BLOCKS = 60
FEWEST_BLOCKS = 20
MOST_SAMPLES = 30_000

SLOWEST_RISE = 4.0


@dataclass(frozen=True, eq=False)
class _Table:
    """Increments (rows,), lags of the command (rows, regressors), and the first row of every record."""

    z: FloatArray
    driven: FloatArray
    starts: tuple[int, ...]


def refuted_lags(
    outputs: Sequence[FloatArray], commands: Sequence[FloatArray], factor: int
) -> tuple[float, float] | None:
    """Least and largest delay at 94 %, in samples of records averaged down by `factor`; None where the
    records are too short, or no lag of the command is seen in the output."""
    table = _table(outputs, commands, factor)
    if table is None:
        return None
    fitted = _whitened(table)
    seen = _latest(fitted)
    if seen is None:
        return None
    return _earliest(fitted, seen), float(seen)


def _table(outputs: Sequence[FloatArray], commands: Sequence[FloatArray], factor: int) -> _Table | None:
    z: list[FloatArray] = []
    driven: list[FloatArray] = []
    starts: list[int] = []
    left = MOST_SAMPLES
    for y, u in zip(outputs, commands, strict=True):
        length = min(len(y) // factor, left)
        if length < 2 * LAGS:
            continue
        left -= length
        v = u[: length * factor].reshape(-1, factor).mean(axis=1)
        lagged = linalg.toeplitz(v, np.full(LAGS + 1, v[0]))
        slower = [_smoothed(v, tail) for tail in TAILS]
        starts.append(sum(len(part) for part in z))
        z.append(np.diff(y[: length * factor : factor]))
        # The increment from sample k to k + 1 is what the command held there made of it, and earlier ones.
        driven.append(np.column_stack([lagged, *slower, np.ones(length)])[:-1])
    if not z:
        return None
    found = _Table(np.concatenate(z), np.concatenate(driven), tuple(starts))
    return found if len(found.z) > 3 * found.driven.shape[1] and np.ptp(found.driven[:, 0]) > 0 else None


def _smoothed(v: FloatArray, samples: float) -> FloatArray:
    """`v` behind a lag of one pole of so many samples, at rest before."""
    kept = np.exp(-1 / samples)
    recursion = np.stack([np.ones(len(v)), np.full(len(v), -kept)])
    return np.asarray(linalg.solve_banded((1, 0), recursion, (1 - kept) * (v - v[0])) + v[0])


def _whitened(table: _Table) -> _Table:
    """Both sides filtered by the autoregression of what the command does not explain."""
    ends = (*table.starts[1:], len(table.z))
    found = table
    for _ in range(ROUNDS):
        left = table.z - table.driven @ _solved(found.driven, found.z)
        parts = [left[a:b] for a, b in zip(table.starts, ends, strict=True)]
        partial, _ = burg(parts, NOISE_ORDER)
        noise = autoregression_from_partial(partial[:, None])[:, 0]
        rows = [slice(a + NOISE_ORDER, b) for a, b in zip(table.starts, ends, strict=True)]
        z, driven = (
            np.concatenate([whitened(whole[a:b], noise) for a, b in zip(table.starts, ends, strict=True)])
            for whole in (table.z, table.driven)
        )
        starts = np.cumsum([0, *(row.stop - row.start for row in rows[:-1])])
        found = _Table(z, driven, tuple(map(int, starts)))
    return found


def _solved(driven: FloatArray, z: FloatArray) -> FloatArray:
    """Least squares; directions that the command hardly excites stay small."""
    size = np.linalg.norm(driven, axis=0)
    size[size == 0] = 1.0
    scaled = driven / size
    inner = scaled.T @ scaled + 1e-9 * np.eye(len(size))
    found = linalg.solve(inner, scaled.T @ z, assume_a="pos")
    return np.asarray(found / (size if z.ndim == 1 else size[:, None]))


def _latest(table: _Table) -> int | None:
    """The smallest d for which no response in the first d lags is refuted; None where none is."""
    edges = np.linspace(0, len(table.z), max(FEWEST_BLOCKS, min(BLOCKS, len(table.z) // 50)) + 1).astype(int)
    most = len(edges) // 4
    for d in range(1, MOST_LAGS + 1):
        later = table.driven[:, d:]
        begin = max(0, d - most)
        both = _solved(later, np.column_stack([table.z, table.driven[:, begin:d]]))
        left = table.z - later @ both[:, 0]
        first = table.driven[:, begin:d] - later @ both[:, 1:]
        scores = np.add.reduceat(first * left[:, None], edges[:-1], axis=0)
        total, covariance = scores.sum(axis=0), scores.T @ scores
        scale = np.sqrt(np.maximum(np.diag(covariance), np.finfo(float).tiny))
        unit = covariance / np.outer(scale, scale) + 1e-6 * np.eye(len(scale))
        squared = float((total / scale) @ linalg.solve(unit, total / scale, assume_a="pos"))
        # About zero, and not the mean, the statistic of n blocks is bounded by n: beta distributed.
        n, k = len(edges) - 1, len(scale)
        if special.betainc(k / 2, (n - k) / 2, min(squared / n, 1.0)) > 1 - LEVEL / MOST_LAGS:
            return d
    return None


def _earliest(table: _Table, seen: int) -> float:
    """Where a response that is first seen in lag `seen` - 1 began at the earliest, in samples."""
    response = _solved(table.driven[:, seen - 1 :], table.z)[: LAGS - seen + 2]
    sign = np.sign(response.sum())
    rising = sign * response
    peak = int(rising.argmax())
    share = float(rising[0] / rising[peak]) if rising[peak] > 0 else 0.0
    if peak == 0:
        return float(seen - 1)
    root = max(share, 0.0) ** (1 / SLOWEST_RISE)
    return max(0.0, seen - 1 - peak * root / (1 - root)) if 0 < share < 1 else 0.0
