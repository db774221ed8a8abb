"""The linear block at fixed parameters: what commands and torques drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate.injection_point import NO_STATES, InjectionPoint, InjectionStates
from bayes_hw.gap.simulate.path import Path, states


@dataclass(frozen=True)
class Chain:
    """Poles and gains of the linear block, in continuous time: paths from the command and from torques on
    motor and load."""

    command_path: Path
    torque_path: Path
    direct: float
    delay_samples: int
    rate: float
    stiffness: tuple[float, float]
    contact_damping: float

    @property
    def structure(self) -> tuple[int, ...]:
        """Numbers of real poles and pairs that the command drives, and of those that torques drive."""
        return (*self.command_path.shape, *self.torque_path.shape)

    def can_inject(self, door: InjectionPoint) -> bool:  # noqa: ARG002
        return True

    def injection_states(self, door: InjectionPoint) -> InjectionStates:
        """What small signals at `door` drive; no states where they are added to w itself."""
        if door == "output":
            return NO_STATES
        held = states([self.command_path if door == "command" else self.torque_path], 1 / self.rate)
        inputs = held.inputs[:, :, 0]
        by_motor, by_load = self.stiffness
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

    def small_responses(self, door: InjectionPoint, signals: FloatArray) -> FloatArray:
        """Change of w (samples, n) for `signals` (samples, n) added at `door`, each held over its sample."""
        return signals if door == "output" else self.injection_states(door).driven_by(signals)

    def torsions(self, commands: FloatArray) -> FloatArray:
        """Torsion (samples, n) of the gear, motor less load in output units, under limited `commands`
        (samples, n), each held over its sample; zero where the drive train is not known."""
        held = states([self.command_path], 1 / self.rate)
        load, motor = held.outputs[:2, :, 0]
        between = InjectionStates(
            held.real_count,
            np.ascontiguousarray(held.factors[:, 0]),
            np.ascontiguousarray(held.inputs[0, :, 0]),
            motor - load,
        )
        return between.driven_by(commands)
