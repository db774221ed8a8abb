"""Linear responses of w to small signals at the doors of an axis."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.chain import Chain
from bayes_hw.gap.chain_kernel import filter_lanes
from bayes_hw.gap.effects.effect import Door
from bayes_hw.gap.path import states
from bayes_hw.model.lanes import padded_to_lanes


def small_responses(chain: Chain, door: Door, signals: FloatArray) -> FloatArray:
    """Change of w (samples, n) for `signals` (samples, n) added at `door`, each held over its sample."""
    if door == "output":
        return signals
    if door == "gear_torque":
        by_motor, by_load = chain.stiffness
        on_motor = small_responses(chain, "motor_torque", signals)
        return small_responses(chain, "load_torque", signals) - by_motor / by_load * on_motor
    path = chain.torque_path if door in ("motor_torque", "load_torque") else chain.command_path
    held = states([path], 1 / chain.rate)
    samples, count = signals.shape
    padded = np.ascontiguousarray(signals)
    if count != padded_to_lanes(count):
        padded = np.zeros((samples, padded_to_lanes(count)))
        padded[:, :count] = signals
    responses = np.empty_like(padded)
    row, w = int(door == "load_torque"), 0
    filter_lanes(
        held.real_count,
        np.ascontiguousarray(held.factors[:, 0]),
        np.ascontiguousarray(held.inputs[row, :, 0]),
        np.ascontiguousarray(held.outputs[w, :, 0]),
        padded,
        responses,
    )
    return responses[:, :count]
