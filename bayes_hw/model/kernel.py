"""The compiled batch simulator: many parameter vectors against one record.

Every walker is one parameter vector of the cascade y = n(G(z) f(u)) (eq. 4 of the paper), with G in modal
(parallel) form, see `bayes_hw.model.modal`:

    v(k)   = min(max(c1 u(k), lower), upper)
    x_r(k+1) = p_r x_r(k) + v(k)                              for every real pole
    s_m(k) = v(k) + a1_m s_m(k-1) - a2_m s_m(k-2)             for every pole pair
    w(k)   = direct v(k) + sum_r r_r x_r(k) + sum_m (b1_m s_m(k-1) + b2_m s_m(k-2))
    y(k)   = c2 max(w(k) - delta, 0) + c3 min(w(k) + delta, 0)
    e(k)   = y_measured(k) - y(k)

Walkers lie in the contiguous lane, LANES at a time, so that one vector instruction serves eight of them; time
advances in blocks that stay in the first-level cache, and each block is reduced at once to what the caller
wants: the lagged sums of e that an AR(p) likelihood needs, or the simulated signals. The functions release
the GIL. An effect with memory (play, friction, a ramp) enters `_advance` between v and the modes, or after w,
with its state beside theirs.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from bayes_hw.arrays import FloatArray
from bayes_hw.model.modal import ModalForm

LANES = 32
BLOCK = 64


class LaggedSums(NamedTuple):
    """What an AR(p) likelihood needs of the residual e(k) = y(k) - simulated y(k).

    `lagged` has shape (p + 1, walkers): sum over k of e(k) e(k - lag). `head` and `tail` have shape
    (p, walkers): the first and the last p residuals, in order of time.
    """

    lagged: FloatArray
    head: FloatArray
    tail: FloatArray


class SimulatedSignals(NamedTuple):
    """w and y of every walker, each of shape (walkers, samples)."""

    w: FloatArray
    y: FloatArray


def lagged_residual_sums(
    form: ModalForm, u: FloatArray, y: FloatArray, delay_samples: int, order: int, before: float = 0.0
) -> LaggedSums:
    """Simulate every walker of `form` on the command `u` and reduce the residual from `y`.

    `u`, `y` have shape (samples,), samples > order; `before` is the command before the first sample.
    """
    walkers = form.walkers
    lagged = np.zeros((order + 1, _padded(walkers)))
    head = np.zeros((order, _padded(walkers)))
    tail = np.zeros((order, _padded(walkers)))
    _lagged_residual_sums(
        *_lane_arrays(form), _delayed(u, delay_samples, before), np.ascontiguousarray(y, np.float64),
        order, lagged, head, tail,
    )  # fmt: skip
    return LaggedSums(lagged[:, :walkers], head[:, :walkers], tail[:, :walkers])


def simulate_batch(
    form: ModalForm, u: FloatArray, delay_samples: int, before: float = 0.0
) -> SimulatedSignals:
    """Simulate every walker of `form` on the command `u`, shape (samples,)."""
    walkers, samples = form.walkers, len(u)
    w = np.empty((_padded(walkers), samples))
    y = np.empty((_padded(walkers), samples))
    _simulate(*_lane_arrays(form), _delayed(u, delay_samples, before), w, y)
    return SimulatedSignals(w[:walkers], y[:walkers])


def _padded(walkers: int) -> int:
    return -(-walkers // LANES) * LANES


def _delayed(u: FloatArray, delay_samples: int, before: float) -> FloatArray:
    delayed = np.full(len(u), before, dtype=np.float64)
    if delay_samples < len(u):
        delayed[delay_samples:] = u[: len(u) - delay_samples]
    return delayed


def _lane_arrays(form: ModalForm) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Pack the form into arrays whose last axis is padded to whole lanes (repeating the last walker)."""
    fill = _padded(form.walkers) - form.walkers

    def pad(values: FloatArray) -> FloatArray:
        widths = [(0, 0)] * (values.ndim - 1) + [(0, fill)]
        return np.ascontiguousarray(np.pad(values, widths, mode="edge"))

    return (
        pad(form.static),
        pad(form.real),
        pad(form.pairs),
        pad(form.real_state),
        pad(form.pair_state),
    )


@njit(cache=True, nogil=True, fastmath={"contract", "nsz"}, error_model="numpy")
def _advance(static, real, pairs, x, s, v, u, start, stop, w_block, y_block):  # type: ignore[no-untyped-def]
    """Advance one group of LANES walkers from sample `start` to `stop`; mode by mode, time inside."""
    count = stop - start
    for row in range(count):
        command = u[start + row]
        for lane in range(LANES):
            value = static[2, lane] * command
            value = static[0, lane] if value < static[0, lane] else value
            value = static[1, lane] if value > static[1, lane] else value
            v[row, lane] = value
            w_block[row, lane] = static[6, lane] * value
    for m in range(real.shape[1]):
        for row in range(count):
            for lane in range(LANES):
                state = x[m, lane]
                w_block[row, lane] += real[1, m, lane] * state
                x[m, lane] = real[0, m, lane] * state + v[row, lane]
    for m in range(pairs.shape[1]):
        for row in range(count):
            for lane in range(LANES):
                newer, older = s[0, m, lane], s[1, m, lane]
                w_block[row, lane] += pairs[2, m, lane] * newer + pairs[3, m, lane] * older
                s[0, m, lane] = v[row, lane] + pairs[0, m, lane] * newer - pairs[1, m, lane] * older
                s[1, m, lane] = newer
    for row in range(count):
        for lane in range(LANES):
            w = w_block[row, lane]
            above = w - static[3, lane]
            below = w + static[3, lane]
            above = above if above > 0.0 else 0.0
            below = below if below < 0.0 else 0.0
            y_block[row, lane] = static[4, lane] * above + static[5, lane] * below


@njit(cache=True, nogil=True, fastmath={"contract", "nsz"}, error_model="numpy")
def _lagged_residual_sums(  # type: ignore[no-untyped-def]
    static, real, pairs, real_state, pair_state, u, y, order, lagged, head, tail
):
    samples = len(u)
    x = np.empty((real.shape[1], LANES))
    s = np.empty((2, pairs.shape[1], LANES))
    v = np.empty((BLOCK, LANES))
    w_block = np.empty((BLOCK, LANES))
    e = np.zeros((order + BLOCK, LANES))
    sums = np.empty((order + 1, LANES))
    for first in range(0, static.shape[1], LANES):
        group = slice(first, first + LANES)
        static_lanes = static[:, group].copy()
        real_lanes = real[:, :, group].copy()
        pair_lanes = pairs[:, :, group].copy()
        x[:] = real_state[:, group]
        s[:] = pair_state[:, :, group]
        e[:] = 0.0
        sums[:] = 0.0
        for start in range(0, samples, BLOCK):
            stop = min(start + BLOCK, samples)
            count = stop - start
            _advance(
                static_lanes, real_lanes, pair_lanes, x, s, v, u, start, stop, w_block, e[order:]
            )
            for row in range(order, order + count):
                measured = y[start + row - order]
                for lane in range(LANES):
                    e[row, lane] = measured - e[row, lane]
            for lag in range(order + 1):
                for row in range(order, order + count):
                    for lane in range(LANES):
                        sums[lag, lane] += e[row, lane] * e[row - lag, lane]
            if start < order:
                for k in range(start, min(stop, order)):
                    head[k, first : first + LANES] = e[order + k - start]
            for row in range(order):
                e[row] = e[row + count]
        lagged[:, first : first + LANES] = sums
        tail[:, first : first + LANES] = e[:order]


@njit(cache=True, nogil=True, fastmath={"contract", "nsz"}, error_model="numpy")
def _simulate(static, real, pairs, real_state, pair_state, u, w_out, y_out):  # type: ignore[no-untyped-def]
    samples = len(u)
    x = np.empty((real.shape[1], LANES))
    s = np.empty((2, pairs.shape[1], LANES))
    v = np.empty((BLOCK, LANES))
    w_block = np.empty((BLOCK, LANES))
    y_block = np.empty((BLOCK, LANES))
    for first in range(0, static.shape[1], LANES):
        group = slice(first, first + LANES)
        static_lanes = static[:, group].copy()
        real_lanes = real[:, :, group].copy()
        pair_lanes = pairs[:, :, group].copy()
        x[:] = real_state[:, group]
        s[:] = pair_state[:, :, group]
        for start in range(0, samples, BLOCK):
            stop = min(start + BLOCK, samples)
            _advance(
                static_lanes, real_lanes, pair_lanes, x, s, v, u, start, stop, w_block, y_block
            )
            for lane in range(LANES):
                for row in range(stop - start):
                    w_out[first + lane, start + row] = w_block[row, lane]
                    y_out[first + lane, start + row] = y_block[row, lane]
