"""Many chains under the same commands at once: a lane of the compiled simulator for each."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.compiled import compiled
from bayes_hw.errors import InputError
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.builder import Followed, KnownPositions
from bayes_hw.gap.simulate.chain import Chain
from bayes_hw.gap.simulate.chain_kernel import simulate_lanes
from bayes_hw.gap.simulate.columns import part
from bayes_hw.gap.simulate.path import states
from bayes_hw.model.controller_kernel import LoopSignals, PositionLoop
from bayes_hw.model.lanes import padded_to_lanes


@compiled
def in_lanes(rows, lanes):  # type: ignore[no-untyped-def]
    """Column `lanes[i]` of `rows` (rows, n) for every lane i."""
    found = np.empty((rows.shape[0], len(lanes)))
    for row in range(rows.shape[0]):
        for i in range(len(lanes)):
            found[row, i] = rows[row, lanes[i]]
    return found


@compiled
def delay(columns, first, u, delays):  # type: ignore[no-untyped-def]
    """Write u (samples,) into silent `columns` (samples, n) from `first` on, each late by its number of
    samples; what comes too late for a record as long as u is left out."""
    for k in range(len(u)):
        for i in range(len(delays)):
            if k >= delays[i]:
                columns[k, first + i] = u[k - delays[i]]


@compiled
def lanes_of(count, records, columns):  # type: ignore[no-untyped-def]
    """The chain (columns,) that every lane simulates: `count` of them a record, the last one again after."""
    found = np.empty(columns, np.int64)
    for i in range(columns):
        found[i] = min(i, count * records - 1) % count
    return found


@compiled
def silence(samples, columns):  # type: ignore[no-untyped-def]
    """Commands (samples, columns) of nothing; numpy would let go of the interpreter to make them."""
    return np.zeros((samples, columns))


TORQUE_STEP = 0.005
"""s; step of a simulation with torques that depend on the motion."""

WITHIN_SAMPLE_STEP = 0.00625
LEAST_WITHIN_SAMPLE, MOST_WITHIN_SAMPLE = 4, 8
"""s; step of a simulation whose command changes between samples, and the fewest and most of them a sample.

At 20 Hz eight leave an error below a twentieth of the noise, at 50 Hz four below a hundredth."""


class ChainSignals(NamedTuple):
    """w and y of one record, both (samples, chains)."""

    w: FloatArray
    y: FloatArray


class LoopInLanes(NamedTuple):
    """A position loop around every lane, as `simulate_lanes` takes it.

    `delays` and `rows` of the noise (lanes,), `states` of G at rest (n, lanes) and where they are `start`
    (1, lanes); `commands` (samples, lanes) is filled. The rest is as in `PositionLoop`.
    """

    numbers: FloatArray
    sections: FloatArray
    ratio: int
    delays: IntArray
    reference: FloatArray
    noise: FloatArray
    rows: IntArray
    states: FloatArray
    start: FloatArray
    commands: FloatArray


_NONE, _TABLE, _COUNTS = np.zeros(0), np.zeros((0, 0)), np.zeros(0, np.int64)
OPEN = LoopInLanes(_NONE, _TABLE, 1, _COUNTS, _NONE, _TABLE, _COUNTS, _TABLE, _TABLE, _TABLE)
"""No loop: the commands are given. The same type, so that one kernel is compiled for both."""


def simulate_loops(chains: Sequence[Chain], settings: FloatArray, loop: PositionLoop) -> LoopSignals:
    """Every chain with its row of `settings` (chains, COUNT) in a position loop.

    Raises InputError where G answers a command in the same sample, so that no controller can precede it.
    """
    active = settings != S.NEUTRAL
    late = loop.delay + chains[0].delay_samples
    if late == 0 and any(chain.direct != 0 for chain in chains):
        raise InputError("linear: G answers a command in the same sample; no position loop can be closed")
    shape = (len(loop.reference), len(chains))
    found = [np.empty(shape) for _ in LoopSignals._fields]
    for some in _alike(chains, active):
        alike = [chains[i] for i in some]
        signals = _loops_alike(alike, settings[some], active[some[0]], loop.take(some))
        for whole, part_of_it in zip(found, signals, strict=True):
            whole[:, some] = part_of_it
    return LoopSignals(*(signal.T for signal in found))


def _alike(chains: Sequence[Chain], active: BoolArray) -> list[IntArray]:
    """Indices of chains of one structure with the same settings `active` (chains, COUNT), group by group."""
    switches = active & S.IS_SWITCH
    groups: dict[tuple[object, ...], list[int]] = {}
    for i, chain in enumerate(chains):
        groups.setdefault((chain.structure, switches[i].tobytes()), []).append(i)
    return [np.array(group) for group in groups.values()]


def simulate_chains(
    chains: Sequence[Chain],
    settings: FloatArray,
    inputs: Sequence[FloatArray],
    keep_w: bool = False,
    known: KnownPositions | None = None,
    followed: Followed | None = None,
) -> list[ChainSignals]:
    """Signals of every record under every chain and its row of `settings` (chains, COUNT).

    `inputs` holds the commands (samples,), one a record. Without `keep_w` the w returned have no samples.
    `known` says where ripple acts if not at the simulated position.
    """
    active = settings != S.NEUTRAL
    groups = _alike(chains, active)
    if len(groups) == 1:
        return _simulate_alike(chains, settings, active[0], inputs, keep_w, known, followed)
    done = []
    for some in groups:
        alike = [chains[i] for i in some]
        done.append(_simulate_alike(alike, settings[some], active[some[0]], inputs, keep_w, known, followed))
    order = np.argsort(np.concatenate(groups))
    return [
        ChainSignals(*(np.concatenate(parts, axis=1)[:, order] for parts in zip(*record, strict=True)))
        for record in zip(*done, strict=True)
    ]


def _simulate_alike(
    chains: Sequence[Chain],
    settings: FloatArray,
    active: BoolArray,
    inputs: Sequence[FloatArray],
    keep_w: bool,
    known: KnownPositions | None,
    followed: Followed | None,
) -> list[ChainSignals]:
    """The same for chains of one structure with the same settings active."""
    rate, count = chains[0].rate, len(chains)
    columns = padded_to_lanes(count * len(inputs))
    lanes = lanes_of(count, len(inputs), columns)
    rows, delays = _whole_delays(chains, settings)
    samples = max(len(u) for u in inputs)
    commands = silence(samples, columns)
    for record, u in enumerate(inputs):
        delay(commands, record * count, u, delays)
    positions = np.zeros((samples if known is not None else 0, columns))
    for record, position in enumerate(known.positions if known is not None else []):
        positions[: len(position), record * count : (record + 1) * count] = position[:, None]
    targets = np.zeros((samples if followed is not None else 0, columns))
    for record, target in enumerate(followed.measured if followed is not None else []):
        targets[: len(target), record * count : (record + 1) * count] = target[:, None]
    w, y = np.empty((samples if keep_w else 0, columns)), np.empty((samples, columns))
    simulate_lanes(
        commands,
        rate,
        substeps_of(active, rate),
        active,
        *_axes(chains, rows, active, lanes),
        positions,
        known.share if known is not None else 0.0,
        targets,
        followed.gains if followed is not None else np.zeros(0),
        w,
        y,
        OPEN,
    )
    return [
        ChainSignals(*(part(signal[: len(u)], record * count, count) for signal in (w, y)))
        for record, u in enumerate(inputs)
    ]


def _loops_alike(
    chains: Sequence[Chain], settings: FloatArray, active: BoolArray, loop: PositionLoop
) -> list[FloatArray]:
    """Command, w and output (samples, chains) of chains of one structure with the same settings active."""
    rate, count, samples = chains[0].rate, len(chains), len(loop.reference)
    columns = padded_to_lanes(count)
    lanes = lanes_of(count, 1, columns)
    rows, delays = _whole_delays(chains, settings)
    axes = _axes(chains, rows, active, lanes)
    real_count, outputs = axes[2], axes[5]
    at = int(np.argmin(np.abs(chains[0].command_path.poles[:real_count])))
    start = np.ascontiguousarray(loop.start[lanes])
    states_at_rest = np.zeros(outputs.shape[1:])
    states_at_rest[at] = start / outputs[0, at]
    u, w, y = (np.zeros((samples, columns)) for _ in range(3))
    simulate_lanes(
        silence(samples, columns),
        rate,
        substeps_of(active, rate),
        active,
        *axes,
        np.zeros((0, columns)),
        0.0,
        np.zeros((0, columns)),
        np.zeros(0),
        w,
        y,
        LoopInLanes(
            loop.numbers,
            loop.sections,
            loop.ratio,
            (delays + loop.delay)[lanes],
            loop.reference,
            loop.noise,
            lanes,
            states_at_rest,
            start[None],
            u,
        ),
    )
    return [part(signal, 0, count) for signal in (u, w, y)]


def _whole_delays(chains: Sequence[Chain], settings: FloatArray) -> tuple[FloatArray, IntArray]:
    """Settings (COUNT, chains) with the part of a sample of EXTRA_DELAY, and the whole samples by which
    commands are late (chains,), G's own among them."""
    whole = np.floor(settings[:, S.EXTRA_DELAY])
    rows = settings.T.copy()
    rows[S.EXTRA_DELAY] -= whole
    return rows, chains[0].delay_samples + whole.astype(np.int64)


def _axes(chains: Sequence[Chain], rows: FloatArray, active: BoolArray, lanes: IntArray) -> tuple[Any, ...]:
    """Settings, direct parts, and states that commands and torques drive, as `simulate_lanes` takes them."""
    rate = chains[0].rate
    h = 1 / (rate * substeps_of(active, rate))
    return (
        in_lanes(rows, lanes),
        in_lanes(np.array([[chain.direct for chain in chains]]), lanes),
        *states([chain.command_path for chain in chains], h, lanes),
        *states([chain.torque_path for chain in chains], h, lanes),
    )


def substeps_of(active: BoolArray, rate: float) -> int:
    """Steps a sample for the settings that are `active` (COUNT,), at `rate` samples per second."""
    torques = any(active[setting] for setting in S.TORQUES)
    substeps = max(1, int(np.ceil(1 / (rate * TORQUE_STEP)))) if torques else 1
    if any(active[setting] for setting in S.WITHIN_SAMPLE):
        within = int(np.ceil(1 / (rate * WITHIN_SAMPLE_STEP)))
        return max(substeps, LEAST_WITHIN_SAMPLE, min(within, MOST_WITHIN_SAMPLE))
    return substeps
