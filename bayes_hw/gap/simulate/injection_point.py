"""Where a small signal is injected into a simulated axis."""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate.chain_kernel import filter_lanes
from bayes_hw.model.lanes import padded_to_lanes

InjectionPoint: TypeAlias = Literal["command", "motor_torque", "load_torque", "gear_torque", "output"]
"""v, a torque on the motor, on the load, or on the load with its reaction on the motor, or w."""


class InjectionStates(NamedTuple):
    """The states (n,) between one door and w, stepped by a sample, as `filter_lanes` takes them."""

    real_count: int
    factors: FloatArray
    inputs: FloatArray
    outputs: FloatArray

    def driven_by(self, signals: FloatArray) -> FloatArray:
        """What the states show (samples, n) of `signals` (samples, n) that drive them."""
        samples, count = signals.shape
        padded = np.ascontiguousarray(signals)
        if count != padded_to_lanes(count):
            padded = np.zeros((samples, padded_to_lanes(count)))
            padded[:, :count] = signals
        responses = np.empty_like(padded)
        filter_lanes(*self, padded, responses)
        return responses[:, :count]


NO_STATES = InjectionStates(0, np.zeros(0), np.zeros(0), np.zeros(0))
