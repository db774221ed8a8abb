"""The compiled batch simulator: many parameter vectors against one record.

Every walker is one parameter vector of the cascade y = n(G(z) f(u)) (eq. 4 of the paper), with G in modal
(parallel) form, see `bayes_hw.model.modal`:

    v(k)     = min(max(c1 u(k), lower), upper)
    x_i(k+1) = p_i x_i(k) + v(k)                                   for every real pole
    s_m(k)   = v(k) + a1_m s_m(k-1) - a2_m s_m(k-2)                for every pole pair
    w(k)     = direct v(k) + sum_i r_i x_i(k) + sum_m (b1_m s_m(k-1) + b2_m s_m(k-2)) + sum_j c_j q_j(k)
    y(k)     = c2 max(w(k) - delta, 0) + c3 min(w(k) + delta, 0) + sum_l c_l q_l(k)
    e(k)     = y_measured(k) - y(k)

with q_j and q_l the signals of known inputs, through the load and at the encoder. A group of LANES walkers
advances together (`bayes_hw.model.lanes`), a short block of samples at a time, four real poles or two pole
pairs at once with coefficients and states in registers; each block is reduced at once to what the caller
wants: the lagged sums of e that an AR(p) likelihood needs, or the simulated signals. The functions release
the GIL. An effect with memory (play, friction, a ramp) enters `_advance` where v or w of the block stand,
with its state kept between blocks as those of the modes are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.compiled import compiled, compiled_inside, pasted
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

BLOCK = 64
"""Samples of a block: its three signals fit the first-level cache beside the coefficients."""
GAP = 16
"""Rows between two signals: half a page, so that no load waits for a store whose address ends alike."""

LOWER, UPPER, C1, HALF_WIDTH, C2, C3, DIRECT = range(7)
POLE, RESIDUE = range(2)
A1, A2, B1, B2 = range(4)
NEWER, OLDER = range(2)


class LaggedSums(NamedTuple):
    """What an AR(p) likelihood needs of the residual e(k) = y(k) - simulated y(k).

    A walker with a coefficient that is NaN has NaN here, and no other walker has.

    `lagged` has shape (p + 1, walkers): sum over k of e(k) e(k - lag). `head` and `tail` have shape
    (p, walkers): the first and the last p residuals, in order of time; `near` (n, walkers) those asked for;
    `whole` (1, walkers) the sum of all.
    """

    lagged: FloatArray
    head: FloatArray
    tail: FloatArray
    near: FloatArray = np.zeros((0, 0))
    whole: FloatArray = np.zeros((0, 0))


class KnownSignals(NamedTuple):
    """Signals of known inputs, `rows` (n, samples): the first `through` of them are added to w, the others to
    the reading, each by the walker's weight in `ModalForm.known`. Without them known inputs rest."""

    rows: FloatArray = np.zeros((0, 0))
    through: int = 0


AT_REST = KnownSignals()


class SimulatedSignals(NamedTuple):
    """w and y of every walker, each of shape (walkers, samples); NaN for a walker with a NaN coefficient."""

    w: FloatArray
    y: FloatArray


NONE: NDArray[np.int64] = np.zeros(0, dtype=np.int64)


def lagged_residual_sums(
    form: ModalForm,
    u: FloatArray,
    y: FloatArray,
    delay_samples: int,
    order: int,
    before: float = 0.0,
    near: NDArray[np.int64] = NONE,
    signals: KnownSignals = AT_REST,
) -> LaggedSums:
    """Simulate every walker of `form` on the command `u` and reduce the residual from `y`.

    `u`, `y` have shape (samples,), samples > order; `before` is the command before the first sample. The
    residuals of the samples `near` (n,), in order of time, are kept as they are.
    """
    walkers, whole = form.walkers, 3 * order + 1
    sums = np.zeros((whole + len(near) + 1, padded_to_lanes(walkers)))
    _lagged_residual_sums(
        *_filled_up(form),
        _delayed(u, delay_samples, before),
        *signals,
        np.ascontiguousarray(y, np.float64),
        order,
        near,
        sums,
    )
    sums = sums[:, :walkers]
    undefined = _undefined(form)
    if np.any(undefined):
        sums[:, undefined] = np.nan
    return LaggedSums(
        sums[: order + 1],
        sums[order + 1 : 2 * order + 1],
        sums[2 * order + 1 : whole],
        sums[whole:-1],
        sums[-1:],
    )


def simulate_batch(
    form: ModalForm,
    u: FloatArray,
    delay_samples: int,
    before: float = 0.0,
    signals: KnownSignals = AT_REST,
) -> SimulatedSignals:
    """Simulate every walker of `form` on the command `u`, shape (samples,)."""
    walkers, samples = form.walkers, len(u)
    w = np.empty((padded_to_lanes(walkers), samples))
    y = np.empty((padded_to_lanes(walkers), samples))
    _simulate(*_filled_up(form), _delayed(u, delay_samples, before), *signals, w, y)
    undefined = _undefined(form)
    w[:walkers][undefined], y[:walkers][undefined] = np.nan, np.nan
    return SimulatedSignals(w[:walkers], y[:walkers])


def _undefined(form: ModalForm) -> BoolArray:
    """Walkers (walkers,) with a limit that is NaN, which the comparisons of the saturation would drop."""
    return np.isnan(form.static[LOWER]) | np.isnan(form.static[UPPER])


def _delayed(u: FloatArray, delay_samples: int, before: float) -> FloatArray:
    delayed = np.full(len(u), before, dtype=np.float64)
    if delay_samples < len(u):
        delayed[delay_samples:] = u[: len(u) - delay_samples]
    return delayed


def _filled_up(form: ModalForm) -> tuple[FloatArray, ...]:
    """Coefficients, initial states and weights of known inputs of whole groups of lanes, walkers last; the
    states are copies."""
    return (
        filled_up(form.static),
        filled_up(form.real),
        filled_up(form.pairs),
        filled_up(form.real_state).copy(),
        filled_up(form.pair_state).copy(),
        filled_up(form.known),
    )


@pasted
def _three_signals(order):  # type: ignore[no-untyped-def]
    """Blocks of v, w and a third signal, this one with `order` rows before it, apart by GAP rows."""
    rows = aligned_rows(3 * BLOCK + 2 * GAP + order)
    second, third = BLOCK + GAP, 2 * (BLOCK + GAP)
    return rows[:BLOCK], rows[second : second + BLOCK], rows[third:]


@compiled_inside
def _add_known(known, signals, first, last, sign, start, count, rows):  # type: ignore[no-untyped-def]
    """Add to the block `rows` the signals from `first` to `last`, weighed, times `sign`."""
    for j in range(first, last):
        weight = load(known, j) * broadcast(sign)
        for row in range(count):
            store(rows, row, load(rows, row) + weight * broadcast(signals[j, start + row]))


@compiled_inside
def _advance(static, real, pairs, x, s, u, start, stop, v, w):  # type: ignore[no-untyped-def]
    """Advance one group from sample `start` to `stop`, filling rows of the blocks v and w."""
    count = stop - start
    n_real, n_pairs = len(x), len(s) // 2
    lower, upper = load(static, LOWER), load(static, UPPER)
    c1, direct = load(static, C1), load(static, DIRECT)
    for row in range(count):
        command = minimum(maximum(c1 * broadcast(u[start + row]), lower), upper)
        store(v, row, command)
        store(w, row, direct * command)
    fours = n_real - n_real % 4
    for i in range(0, fours, 4):
        p0, r0 = load(real, POLE * n_real + i), load(real, RESIDUE * n_real + i)
        p1, r1 = load(real, POLE * n_real + i + 1), load(real, RESIDUE * n_real + i + 1)
        p2, r2 = load(real, POLE * n_real + i + 2), load(real, RESIDUE * n_real + i + 2)
        p3, r3 = load(real, POLE * n_real + i + 3), load(real, RESIDUE * n_real + i + 3)
        x0, x1, x2, x3 = load(x, i), load(x, i + 1), load(x, i + 2), load(x, i + 3)
        for row in range(count):
            command = load(v, row)
            store(w, row, (load(w, row) + r0 * x0 + r1 * x1) + (r2 * x2 + r3 * x3))
            x0 = command + p0 * x0
            x1 = command + p1 * x1
            x2 = command + p2 * x2
            x3 = command + p3 * x3
        store(x, i, x0)
        store(x, i + 1, x1)
        store(x, i + 2, x2)
        store(x, i + 3, x3)
    for i in range(fours, n_real):
        p, r = load(real, POLE * n_real + i), load(real, RESIDUE * n_real + i)
        state = load(x, i)
        for row in range(count):
            store(w, row, load(w, row) + r * state)
            state = load(v, row) + p * state
        store(x, i, state)
    for m in range(0, n_pairs - 1, 2):
        a1, a2 = load(pairs, A1 * n_pairs + m), load(pairs, A2 * n_pairs + m)
        b1, b2 = load(pairs, B1 * n_pairs + m), load(pairs, B2 * n_pairs + m)
        c1, c2 = load(pairs, A1 * n_pairs + m + 1), load(pairs, A2 * n_pairs + m + 1)
        d1, d2 = load(pairs, B1 * n_pairs + m + 1), load(pairs, B2 * n_pairs + m + 1)
        newer, older = load(s, NEWER * n_pairs + m), load(s, OLDER * n_pairs + m)
        second, second_older = load(s, NEWER * n_pairs + m + 1), load(s, OLDER * n_pairs + m + 1)
        for row in range(count):
            command = load(v, row)
            store(w, row, load(w, row) + b2 * older + b1 * newer + d2 * second_older + d1 * second)
            newest = command - a2 * older + a1 * newer
            second_newest = command - c2 * second_older + c1 * second
            older, second_older = newer, second
            newer, second = newest, second_newest
        store(s, NEWER * n_pairs + m, newer)
        store(s, OLDER * n_pairs + m, older)
        store(s, NEWER * n_pairs + m + 1, second)
        store(s, OLDER * n_pairs + m + 1, second_older)
    for m in range(n_pairs - n_pairs % 2, n_pairs):
        a1, a2 = load(pairs, A1 * n_pairs + m), load(pairs, A2 * n_pairs + m)
        b1, b2 = load(pairs, B1 * n_pairs + m), load(pairs, B2 * n_pairs + m)
        newer, older = load(s, NEWER * n_pairs + m), load(s, OLDER * n_pairs + m)
        for row in range(count):
            store(w, row, load(w, row) + b2 * older + b1 * newer)
            newest = load(v, row) - a2 * older + a1 * newer
            older = newer
            newer = newest
        store(s, NEWER * n_pairs + m, newer)
        store(s, OLDER * n_pairs + m, older)


@compiled(nogil=True)
def _lagged_residual_sums(  # type: ignore[no-untyped-def]
    static, real, pairs, real_state, pair_state, known, u, signals, through, y, order, near, sums
):
    """Fill sums (3 order + 2 + near, walkers): lagged products, first and last residuals, `near`, the sum."""
    samples, groups = len(u), static.shape[1] // LANES
    n_real, n_pairs = real.shape[1], pairs.shape[1]
    one_static, one_real, one_pairs = aligned_rows(7), aligned_rows(2 * n_real), aligned_rows(4 * n_pairs)
    x, s, total = aligned_rows(n_real), aligned_rows(2 * n_pairs), aligned_rows(len(sums))
    weights = aligned_rows(len(known))
    v, w, e = _three_signals(order)
    new = e[order:]
    zero = broadcast(0.0)
    for group in range(groups):
        gather(static, group, one_static)
        gather(real, group, one_real)
        gather(pairs, group, one_pairs)
        gather(real_state, group, x)
        gather(pair_state, group, s)
        gather(known, group, weights)
        delta, c2, c3 = load(one_static, HALF_WIDTH), load(one_static, C2), load(one_static, C3)
        total[:] = 0.0
        e[:] = 0.0
        kept = 0
        for start in range(0, samples, BLOCK):
            stop = min(start + BLOCK, samples)
            count = stop - start
            _advance(one_static, one_real, one_pairs, x, s, u, start, stop, v, w)
            _add_known(weights, signals, 0, through, 1.0, start, count, w)
            squares, whole = load(total, 0), load(total, len(sums) - 1)
            for row in range(count):
                position = load(w, row)
                above, below = maximum(position - delta, zero), minimum(position + delta, zero)
                residual = broadcast(y[start + row]) - c2 * above - c3 * below
                store(new, row, residual)
                squares = squares + residual * residual
                whole = whole + residual
            if through < len(signals):
                _add_known(weights, signals, through, len(signals), -1.0, start, count, new)
                squares, whole = load(total, 0), load(total, len(sums) - 1)
                for row in range(count):
                    squares = squares + load(new, row) * load(new, row)
                    whole = whole + load(new, row)
            store(total, 0, squares)
            store(total, len(sums) - 1, whole)
            for lag in range(1, order + 1):
                even, odd = load(total, lag), zero
                for row in range(order, order + count - 1, 2):
                    even = even + load(e, row) * load(e, row - lag)
                    odd = odd + load(e, row + 1) * load(e, row + 1 - lag)
                if count % 2:
                    even = even + load(e, order + count - 1) * load(e, order + count - 1 - lag)
                store(total, lag, even + odd)
            for k in range(start, min(stop, order)):
                store(total, order + 1 + k, load(new, k - start))
            while kept < len(near) and near[kept] < stop:
                store(total, 3 * order + 1 + kept, load(new, near[kept] - start))
                kept += 1
            for row in range(order):
                store(e, row, load(e, row + count))
        for row in range(order):
            store(total, 2 * order + 1 + row, load(e, row))
        scatter(total, group, sums)


@compiled(nogil=True)
def _simulate(  # type: ignore[no-untyped-def]
    static, real, pairs, real_state, pair_state, known, u, signals, through, w_out, y_out
):
    """Fill w_out and y_out (walkers, samples), and leave the states after the last sample in place of those
    before."""
    samples, groups = len(u), static.shape[1] // LANES
    n_real, n_pairs = real.shape[1], pairs.shape[1]
    one_static, one_real, one_pairs = aligned_rows(7), aligned_rows(2 * n_real), aligned_rows(4 * n_pairs)
    x, s, weights = aligned_rows(n_real), aligned_rows(2 * n_pairs), aligned_rows(len(known))
    v, w, y = _three_signals(0)
    zero = broadcast(0.0)
    for group in range(groups):
        gather(static, group, one_static)
        gather(real, group, one_real)
        gather(pairs, group, one_pairs)
        gather(real_state, group, x)
        gather(pair_state, group, s)
        gather(known, group, weights)
        delta, c2, c3 = load(one_static, HALF_WIDTH), load(one_static, C2), load(one_static, C3)
        for start in range(0, samples, BLOCK):
            stop = min(start + BLOCK, samples)
            _advance(one_static, one_real, one_pairs, x, s, u, start, stop, v, w)
            _add_known(weights, signals, 0, through, 1.0, start, stop - start, w)
            for row in range(stop - start):
                position = load(w, row)
                above, below = maximum(position - delta, zero), minimum(position + delta, zero)
                store(y, row, c2 * above + c3 * below)
            _add_known(weights, signals, through, len(signals), 1.0, start, stop - start, y)
            for lane in range(LANES):
                walker = group * LANES + lane
                for row in range(stop - start):
                    w_out[walker, start + row] = w[row, lane]
                    y_out[walker, start + row] = y[row, lane]
        scatter(x, group, real_state)
        scatter(s, group, pair_state)
