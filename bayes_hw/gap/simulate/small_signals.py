"""Linear responses of w to small signals at the doors of an axis, and the torsion behind its commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate.chain_kernel import filter_lanes
from bayes_hw.gap.simulate.injection_point import InjectionPoint
from bayes_hw.gap.simulate.path import states
from bayes_hw.model.lanes import padded_to_lanes

if TYPE_CHECKING:
    from bayes_hw.gap.simulate.chain import Chain


class InjectionStates(NamedTuple):
    """The states (n,) between one door and w, stepped by a sample, as `filter_lanes` takes them."""

    real_count: int
    factors: FloatArray
    inputs: FloatArray
    outputs: FloatArray


NO_STATES = InjectionStates(0, np.zeros(0), np.zeros(0), np.zeros(0))


def injection_states(chain: Chain, door: InjectionPoint) -> InjectionStates:
    """What small signals at `door` drive; no states where they are added to w itself."""
    if door == "output":
        return NO_STATES
    held = states([chain.command_path if door == "command" else chain.torque_path], 1 / chain.rate)
    inputs = held.inputs[:, :, 0]
    by_motor, by_load = chain.stiffness
    weights = {
        "command": (1.0,),
        "motor_torque": (1.0, 0.0),
        "load_torque": (0.0, 1.0),
        "gear_torque": (-by_motor / by_load, 1.0),
    }[door]
    return InjectionStates(
        held.real_count,
        np.ascontiguousarray(held.factors[:, 0]),
        np.array(weights) @ inputs,
        np.ascontiguousarray(held.outputs[0, :, 0]),
    )


def small_responses(chain: Chain, door: InjectionPoint, signals: FloatArray) -> FloatArray:
    """Change of w (samples, n) for `signals` (samples, n) added at `door`, each held over its sample."""
    if door == "output":
        return signals
    return _driven(injection_states(chain, door), signals)


def torsions(chain: Chain, commands: FloatArray) -> FloatArray:
    """Torsion (samples, n) of the gear, motor less load in output units, under limited `commands` (samples,
    n), each held over its sample; zero where the drive train is not known."""
    held = states([chain.command_path], 1 / chain.rate)
    load, motor = held.outputs[:2, :, 0]
    between = InjectionStates(
        held.real_count,
        np.ascontiguousarray(held.factors[:, 0]),
        np.ascontiguousarray(held.inputs[0, :, 0]),
        motor - load,
    )
    return _driven(between, commands)


def _driven(between: InjectionStates, signals: FloatArray) -> FloatArray:
    """What the states show (samples, n) of `signals` (samples, n) that drive them."""
    samples, count = signals.shape
    padded = np.ascontiguousarray(signals)
    if count != padded_to_lanes(count):
        padded = np.zeros((samples, padded_to_lanes(count)))
        padded[:, :count] = signals
    responses = np.empty_like(padded)
    filter_lanes(*between, padded, responses)
    return responses[:, :count]
