"""Many chains under the same commands at once: a lane of the compiled simulator for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.batch_kernel import delay, in_lanes, lanes_of, silence
from bayes_hw.gap.simulate.chain_kernel import simulate_lanes
from bayes_hw.gap.simulate.columns import part
from bayes_hw.gap.simulate.path import states
from bayes_hw.model.lanes import padded_to_lanes

if TYPE_CHECKING:
    from bayes_hw.gap.simulate.chain import Chain

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


@dataclass(frozen=True)
class KnownPositions:
    """Positions of the axis (samples,), one array a record, at which its ripple is taken by `share`: it acts
    that share of the way from the simulated w to them."""

    positions: Sequence[FloatArray]
    share: float


@dataclass(frozen=True)
class Followed:
    """Measured outputs (samples,), one array a record, infinite where there is no reading, and what a unit of
    the difference from them adds to the states that torques drive (states,).

    `spread` is the standard deviation of that difference, in units of the encoder's noise.
    """

    measured: Sequence[FloatArray]
    gains: FloatArray
    spread: float


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
    switches = active & S.IS_SWITCH
    groups: dict[tuple[object, ...], list[int]] = {}
    for i, chain in enumerate(chains):
        groups.setdefault((chain.structure, switches[i].tobytes()), []).append(i)
    if len(groups) == 1:
        return _simulate_alike(chains, settings, active[0], inputs, keep_w, known, followed)
    done = []
    for group in groups.values():
        some = np.array(group)
        alike = [chains[i] for i in group]
        done.append(_simulate_alike(alike, settings[some], active[some[0]], inputs, keep_w, known, followed))
    order = np.argsort(np.concatenate([np.array(group) for group in groups.values()]))
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
    substeps = substeps_of(active, rate)
    h = 1 / (rate * substeps)
    columns = padded_to_lanes(count * len(inputs))
    lanes = lanes_of(count, len(inputs), columns)
    whole = np.floor(settings[:, S.EXTRA_DELAY])
    rows = settings.T.copy()
    rows[S.EXTRA_DELAY] -= whole
    samples = max(len(u) for u in inputs)
    commands = silence(samples, columns)
    delays = chains[0].delay_samples + whole.astype(np.int64)
    for record, u in enumerate(inputs):
        delay(commands, record * count, u, delays)
    command = states([chain.command_path for chain in chains], h, lanes)
    torque = states([chain.torque_path for chain in chains], h, lanes)
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
        substeps,
        active,
        in_lanes(rows, lanes),
        in_lanes(np.array([[chain.direct for chain in chains]]), lanes),
        *command,
        *torque,
        positions,
        known.share if known is not None else 0.0,
        targets,
        followed.gains if followed is not None else np.zeros(0),
        w,
        y,
    )
    return [
        ChainSignals(*(part(signal[: len(u)], record * count, count) for signal in (w, y)))
        for record, u in enumerate(inputs)
    ]


def substeps_of(active: BoolArray, rate: float) -> int:
    """Steps a sample for the settings that are `active` (COUNT,), at `rate` samples per second."""
    torques = any(active[setting] for setting in S.TORQUES)
    substeps = max(1, int(np.ceil(1 / (rate * TORQUE_STEP)))) if torques else 1
    if any(active[setting] for setting in S.WITHIN_SAMPLE):
        within = int(np.ceil(1 / (rate * WITHIN_SAMPLE_STEP)))
        return max(substeps, LEAST_WITHIN_SAMPLE, min(within, MOST_WITHIN_SAMPLE))
    return substeps
