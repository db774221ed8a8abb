"""What a Student-t likelihood needs of the residual, reduced block by block as in `bayes_hw.model.kernel`.

    a(k) = e(k) - phi_1 e(k-1) - ... - phi_p e(k-p)                for k >= p
    sum over k of log(1 + precision a(k)^2)

The logarithm is taken of the product of ROWS_A_LOGARITHM terms at a time.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled
from bayes_hw.model.kernel import (
    AT_REST,
    BLOCK,
    C2,
    C3,
    HALF_WIDTH,
    NONE,
    KnownSignals,
    _add_known,
    _advance,
    _delayed,
    _filled_up,
    _undefined,
)
from bayes_hw.model.lanes import (
    LANES,
    aligned_rows,
    broadcast,
    filled_up,
    gather,
    load,
    maximum,
    minimum,
    padded_to_lanes,
    scatter,
    store,
)
from bayes_hw.model.modal import ModalForm

ROWS_A_LOGARITHM = 4
"""Terms of one product: each may reach 1e77 before it overflows."""


class RobustSums(NamedTuple):
    """`logarithms` (walkers,), the sum of the module's docstring; `head` (p, walkers), first residuals, and
    `near` (n, walkers) those asked for."""

    logarithms: FloatArray
    head: FloatArray
    near: FloatArray


def robust_residual_sums(
    form: ModalForm,
    u: FloatArray,
    y: FloatArray,
    delay_samples: int,
    autoregression: FloatArray,
    precision: FloatArray,
    before: float = 0.0,
    near: NDArray[np.int64] = NONE,
    signals: KnownSignals = AT_REST,
) -> RobustSums:
    """Simulate every walker on the command `u` (samples,) and reduce its residual from `y` (samples,).

    `autoregression` (p, walkers) and `precision` (walkers,) are each walker's own; samples > p. The residuals
    of the samples `near` (n,), in order of time, are kept as they are.
    """
    walkers, order = form.walkers, len(autoregression)
    sums = np.zeros((order + 1 + len(near), padded_to_lanes(walkers)))
    _robust_residual_sums(
        *_filled_up(form),
        _delayed(u, delay_samples, before),
        *signals,
        np.ascontiguousarray(y, np.float64),
        filled_up(np.concatenate([precision[None], autoregression])),
        near,
        sums,
    )
    sums = sums[:, :walkers]
    undefined = _undefined(form)
    if np.any(undefined):
        sums[:, undefined] = np.nan
    return RobustSums(sums[0], sums[1 : order + 1], sums[order + 1 :])


@compiled(nogil=True)
def _robust_residual_sums(  # type: ignore[no-untyped-def]
    static, real, pairs, real_state, pair_state, known, u, signals, through, y, noise, near, sums
):
    """Fill sums (p + 1 + near, walkers); `noise` (p + 1, walkers) holds precision and coefficients."""
    samples, groups, order = len(u), static.shape[1] // LANES, len(noise) - 1
    n_real, n_pairs = real.shape[1], pairs.shape[1]
    one_static, one_real, one_pairs = aligned_rows(7), aligned_rows(2 * n_real), aligned_rows(4 * n_pairs)
    x, s, one_noise = aligned_rows(n_real), aligned_rows(2 * n_pairs), aligned_rows(order + 1)
    v, w, e, total = (
        aligned_rows(BLOCK),
        aligned_rows(BLOCK),
        aligned_rows(order + BLOCK),
        aligned_rows(len(sums)),
    )
    terms, weights = aligned_rows(1), aligned_rows(len(known))
    new = e[order:]
    zero, one = broadcast(0.0), broadcast(1.0)
    for group in range(groups):
        gather(static, group, one_static)
        gather(real, group, one_real)
        gather(pairs, group, one_pairs)
        gather(real_state, group, x)
        gather(pair_state, group, s)
        gather(noise, group, one_noise)
        gather(known, group, weights)
        delta, c2, c3 = load(one_static, HALF_WIDTH), load(one_static, C2), load(one_static, C3)
        precision = load(one_noise, 0)
        total[:] = 0.0
        e[:] = 0.0
        kept = 0
        for start in range(0, samples, BLOCK):
            stop = min(start + BLOCK, samples)
            count = stop - start
            _advance(one_static, one_real, one_pairs, x, s, u, start, stop, v, w)
            _add_known(weights, signals, 0, through, 1.0, start, count, w)
            for row in range(count):
                position = load(w, row)
                above, below = maximum(position - delta, zero), minimum(position + delta, zero)
                store(new, row, broadcast(y[start + row]) - c2 * above - c3 * below)
            _add_known(weights, signals, through, len(signals), -1.0, start, count, new)
            for k in range(start, min(stop, order)):
                store(total, 1 + k, load(new, k - start))
            while kept < len(near) and near[kept] < stop:
                store(total, order + 1 + kept, load(new, near[kept] - start))
                kept += 1
            for first in range(max(order - start, 0), count, ROWS_A_LOGARITHM):
                product = one
                for row in range(first, min(first + ROWS_A_LOGARITHM, count)):
                    innovation = load(e, order + row)
                    for lag in range(1, order + 1):
                        innovation = innovation - load(one_noise, lag) * load(e, order + row - lag)
                    product = product * (one + precision * innovation * innovation)
                store(terms, 0, product)
                for lane in range(LANES):
                    total[0, lane] += np.log(terms[0, lane])
            for row in range(order):
                store(e, row, load(e, row + count))
        scatter(total, group, sums)
