"""The batch simulator block by block: many walkers on a record too long to hold what they all give."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numba import njit

from bayes_hw.arrays import FloatArray
from bayes_hw.model.kernel import (
    BLOCK,
    C2,
    C3,
    HALF_WIDTH,
    _advance,
    _delayed,
    _filled_up,
    _three_signals,
)
from bayes_hw.model.lanes import (
    LANES,
    aligned_rows,
    broadcast,
    gather,
    load,
    maximum,
    minimum,
    scatter,
    store,
)
from bayes_hw.model.modal import ModalForm

SAMPLES = 128 * BLOCK
"""Samples simulated at a time."""


def simulated_blocks(
    form: ModalForm, u: FloatArray, delay_samples: int, before: float = 0.0
) -> Iterator[tuple[int, FloatArray]]:
    """The first sample and y (walkers, at most SAMPLES) of every block of the response to u (samples,).

    Every block is written over the one before it: copy what is to be kept. `before` is the command before the
    first sample.
    """
    static, real, pairs, *states = _filled_up(form)
    real_state, pair_state = (state.copy() for state in states)
    delayed = _delayed(u, delay_samples, before)
    y = np.empty((static.shape[-1], SAMPLES))
    for begin in range(0, len(u), SAMPLES):
        part = delayed[begin : begin + SAMPLES]
        _simulate_on(static, real, pairs, real_state, pair_state, part, y)
        yield begin, y[: form.walkers, : len(part)]


@njit(cache=True, nogil=True, error_model="numpy")
def _simulate_on(static, real, pairs, real_state, pair_state, u, y_out):  # type: ignore[no-untyped-def]
    """Fill y_out (walkers, samples) and leave the states after the last sample in place of those before."""
    samples, groups = len(u), static.shape[1] // LANES
    n_real, n_pairs = real.shape[1], pairs.shape[1]
    one_static, one_real, one_pairs = aligned_rows(7), aligned_rows(2 * n_real), aligned_rows(4 * n_pairs)
    x, s = aligned_rows(n_real), aligned_rows(2 * n_pairs)
    v, w, y = _three_signals(0)
    zero = broadcast(0.0)
    for group in range(groups):
        gather(static, group, one_static)
        gather(real, group, one_real)
        gather(pairs, group, one_pairs)
        gather(real_state, group, x)
        gather(pair_state, group, s)
        delta, c2, c3 = load(one_static, HALF_WIDTH), load(one_static, C2), load(one_static, C3)
        for start in range(0, samples, BLOCK):
            stop = min(start + BLOCK, samples)
            _advance(one_static, one_real, one_pairs, x, s, u, start, stop, v, w)
            for row in range(stop - start):
                position = load(w, row)
                above, below = maximum(position - delta, zero), minimum(position + delta, zero)
                store(y, row, c2 * above + c3 * below)
            for lane in range(LANES):
                walker = group * LANES + lane
                for row in range(stop - start):
                    y_out[walker, start + row] = y[row, lane]
        scatter(x, group, real_state)
        scatter(s, group, pair_state)
