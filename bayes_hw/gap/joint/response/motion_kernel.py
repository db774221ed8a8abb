"""What a compiled simulation of a cascade with effects carries from step to step, and its tangents."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.compiled import compiled_inside, pasted
from bayes_hw.gap.joint.response.state_kernel import (
    by_rows,
    entering,
    own_columns,
    seen,
    signal_sources,
    state_sources,
)
from bayes_hw.model.lanes import LANES, aligned_rows, broadcast, store

RAMPS = 3
WRITTEN_AT_ONCE = 32
"""Samples of tangents that are collected before they are written row by row."""


class Motion(NamedTuple):
    """`carried` (states + 1 + laws,): the states, v and the torques, which are `torques` too; every law's
    `signals` and `memory` (laws,). The weights by which v and torques enter the states, `enters`
    (1 + laws, states), and by which states and v are seen in w and in every signal, `looks`
    (1 + laws, states + 1); `own` (laws,): the speed that a unit of a torque makes up over the step that it
    acts on. `ramps`: the ends of the ramp before the limiter and of the one behind it, and where a ramp that
    moves at once has moved to in this sample. `entered` (states,) is for use within a step."""

    carried: FloatArray
    torques: FloatArray
    signals: FloatArray
    memory: FloatArray
    enters: FloatArray
    looks: FloatArray
    own: FloatArray
    ramps: FloatArray
    entered: FloatArray


class Sources(NamedTuple):
    """Which carriers feed rows of tangents, as `state_kernel.by_rows` orders them."""

    rows: IntArray
    carriers: IntArray
    weights: FloatArray


class Tangents(NamedTuple):
    """Derivatives by `size` columns in `blocks` of LANES, a row for every state, or every law, of each
    block: of the `states`, of what feeds them, of torques, signals and memories; of w, v, and of what is
    `seen` behind a play; of the last readings. `each_...` are the same numbers one by one. `ramps`
    (RAMPS, columns); `moving`: the columns that move v at all; `own`: where a torque's own part of the speed
    has a column. `units` (LANES, LANES) holds a row for every lane."""

    size: int
    blocks: int
    states: FloatArray
    fed: FloatArray
    torques: FloatArray
    signals: FloatArray
    memory: FloatArray
    own: FloatArray
    w: FloatArray
    v: FloatArray
    seen: FloatArray
    readings: FloatArray
    each_w: FloatArray
    each_v: FloatArray
    each_seen: FloatArray
    each_reading: FloatArray
    ramps: FloatArray
    moving: IntArray
    units: FloatArray
    of_states: Sources
    of_signals: Sources


@pasted
def at_rest(axis, steps):  # type: ignore[no-untyped-def]
    """The `Motion` of an axis that stands at zero."""
    enters, looks = entering(axis.paths), seen(axis.paths, axis.laws, steps)
    laws, states = len(axis.laws.law), enters.shape[1]
    carried, own = np.zeros(states + 1 + laws), np.zeros(laws)
    for j in range(laws):
        for i in range(states):
            own[j] += steps * (enters[1 + j, i] * looks[0, i])
    return Motion(
        carried, carried[states + 1 :], np.zeros(laws), np.zeros(laws), enters, looks, own, np.zeros(RAMPS),
        np.zeros(states),
    )  # fmt: skip


@pasted
def tangents_at_rest(axis, steps, columns, limits_move, plays):  # type: ignore[no-untyped-def]
    """The `Tangents` of an axis that stands at zero, whose limits depend on its angle or not, and behind a
    play or not."""
    laws, paths = len(axis.laws.law), columns.paths
    states = paths.real.shape[1] + 2 * paths.sections.shape[1] + laws + 2
    blocks = (columns.size + LANES - 1) // LANES
    w, v = zeros(blocks), zeros(blocks)
    seen_rows = zeros(blocks) if plays else w
    readings = zeros(WRITTEN_AT_ONCE * blocks)
    where, signs = state_sources(paths)
    of_states = by_rows(where, signs, states)
    where, weights = signal_sources(axis.paths, axis.laws, steps, paths)
    of_signals = by_rows(where, weights, laws)
    return Tangents(
        columns.size, blocks, zeros(blocks * states), zeros(blocks * states), zeros(blocks * laws),
        zeros(blocks * laws), zeros(blocks * laws), own_columns(zeros(blocks * laws), laws, paths), w, v,
        seen_rows, readings, w.reshape(-1), v.reshape(-1), seen_rows.reshape(-1), readings.reshape(-1),
        np.zeros((RAMPS, blocks * LANES)), moving_columns(columns, limits_move), identity(),
        Sources(of_states[0], of_states[1], of_states[2]),
        Sources(of_signals[0], of_signals[1], of_signals[2]),
    )  # fmt: skip


@compiled_inside
def moving_columns(columns, limits_move):  # type: ignore[no-untyped-def]
    """The columns that move the command: all where limits depend on the angle, none without tangents."""
    found, at = np.empty(columns.size, np.int64), 0
    for c in range(columns.size):
        moves = limits_move or c == columns.static[0] or c == columns.static[1]
        for other in columns.inputs:
            moves = moves or c == other
        if moves:
            found[at] = c
            at += 1
    return found[:at]


@compiled_inside
def zeros(rows):  # type: ignore[no-untyped-def]
    """(rows, LANES) aligned."""
    found = aligned_rows(rows)
    for row in range(rows):
        store(found, row, broadcast(0.0))
    return found


@compiled_inside
def identity():  # type: ignore[no-untyped-def]
    """(LANES, LANES): a row for every lane."""
    found = zeros(LANES)
    for lane in range(LANES):
        found[lane, lane] = 1.0
    return found
