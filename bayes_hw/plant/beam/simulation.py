"""A record of an axis of finite elements: the linear part exactly, the faults' torques on top of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.plant.beam.drive import (
    DEMAND,
    INPUTS,
    LOAD_TORQUE,
    MOTOR_TORQUE,
    PAIR_TORQUE,
    REFERENCE,
    STRUCTURE_TORQUE,
    Drive,
)
from bayes_hw.plant.integrator import (
    EXTERNAL_BRAKE,
    EXTERNAL_LOAD,
    EXTERNAL_MOTOR,
    EXTERNAL_STRUCTURE,
    Gear,
    Physics,
    advance,
    copied,
    demand_correction,
    driven,
    gear_correction,
    resistance,
    rub,
    slipped,
    wave_value,
    yielding,
)
from bayes_hw.plant.run import Reading, RecordRun

SLOWEST_STEP_HZ = 2000.0


@dataclass(frozen=True)
class BeamAxis:
    """Limiter (deg/s), drive and the dead zone (deg) of the output."""

    drive: Drive
    lower: float
    upper: float
    dead_zone: float
    delay_samples: int
    sample_rate_hz: float

    @property
    def substeps(self) -> int:
        return math.ceil(SLOWEST_STEP_HZ / self.sample_rate_hz)

    @property
    def step_s(self) -> float:
        return 1 / (self.sample_rate_hz * self.substeps)


@dataclass
class BeamRun(RecordRun):
    """What the faults have changed in the drive, its commands and its readings.

    `sampled_ramp` is the largest change of the limited command in a sample, where the controller ramps it;
    `early_step` rounds the reading before its noise comes to it.
    """

    axis: BeamAxis
    drive: Drive = field(init=False)
    sampled_ramp: float = math.inf
    early_step: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        self.drive = self.axis.drive

    def delayed(self) -> FloatArray:
        if not math.isfinite(self.sampled_ramp):
            return super().delayed()
        value, ramped = 0.0, np.empty_like(self.command)
        for k, wanted in enumerate(np.clip(self.command, self.axis.lower, self.axis.upper).tolist()):
            value += min(max(wanted - value, -self.sampled_ramp), self.sampled_ramp)
            ramped[k] = value
        self.command = ramped
        return super().delayed()

    def angles(self) -> FloatArray:
        """The angle in deg that the encoder's disc has after any play, at every step (steps,)."""
        drive, body = self.drive, self.drive.mechanism
        transition, forcing = drive.step_matrices(self.axis.step_s)
        one, other, stiffness = body.mesh
        places = np.array([body.motors[0], body.hub, one, other, body.size])
        asked, direct = drive.demand()
        external = self.external if self.external.any() else self.external[:1]
        return np.asarray(
            integrate_beam(
                transition, forcing, drive.read(), asked, direct, places, self.delayed(), external,
                self.physics, Gear(stiffness, 0.0, 0.0, 0.0, 1.0), self.axis.step_s,
            )
        )  # fmt: skip

    def read(self, angles: FloatArray) -> Reading:
        reading = super().read(angles)
        if self.early_step > 0.0:
            error = self.early_step * np.round(reading.angle / self.early_step) - reading.angle
            self.drift = self.drift + error
            return Reading(
                reading.angle, self.drift, reading.outliers, reading.repeated, reading.quantization_step
            )
        return reading


@compiled_inside  # type: ignore[untyped-decorator]
def _torques(
    x: FloatArray,
    v: float,
    slip: float,
    yielded: float,
    outside: FloatArray,
    physics: Physics,
    gear: Gear,
    asked: FloatArray,
    direct: float,
    places: FloatArray,
    inputs: FloatArray,
) -> None:
    """The smooth torques of the faults at state x, added to `inputs`."""
    motor, load, one, other, n = places
    inputs[MOTOR_TORQUE] += wave_value(physics.motor_ripple, x[motor])
    inputs[LOAD_TORQUE] += wave_value(physics.load_ripple, x[load])
    inputs[LOAD_TORQUE] -= resistance(x[load], x[n + load], outside, physics)
    twist, rate = x[one] - x[other], x[n + one] - x[n + other]
    inputs[PAIR_TORQUE] += gear_correction(twist, rate, x[other], slip, yielded, physics, gear)
    demand = direct * v
    for i in range(len(x)):
        demand += asked[i] * x[i]
    inputs[DEMAND] += demand_correction(demand, outside, physics)


@compiled  # type: ignore[untyped-decorator]
def integrate_beam(
    transition: FloatArray,
    forcing: FloatArray,
    read: FloatArray,
    asked: FloatArray,
    direct: float,
    places: FloatArray,
    command: FloatArray,
    external: FloatArray,
    physics: Physics,
    gear: Gear,
    step: float,
) -> FloatArray:
    """The angle that is read, after the play, at every step from rest at zero; shape (steps,).

    `read` and `asked` (states,) weigh the states in that angle and in the loop's demand, `direct` v in it;
    `places` are the coordinates of motor, load and the two ends of the mesh, and their number; `command`
    (steps,) and `external` (steps, 8) or (1, 8) as for the home plant.
    """
    steps, n = len(command), places[4]
    w = np.empty(steps)
    x, predicted = np.zeros(len(read)), np.zeros(len(read))
    inputs, corrected = np.zeros(INPUTS), np.zeros(INPUTS)
    motor_response, load_response = forcing[:, MOTOR_TORQUE].copy(), forcing[:, LOAD_TORQUE].copy()
    motor_bristle = load_bristle = slip = yielded = out = ramp = eased = 0.0
    motor, load, one, other = places[0], places[1], places[2], places[3]
    for k in range(steps):
        angle = 0.0
        for i in range(len(x)):
            angle += read[i] * x[i]
        play = physics.play_half_gap
        out = min(max(out, angle - play), angle + play)
        w[k] = out
        outside = external[min(k, len(external) - 1)]
        v, ramp, eased = driven(command[k], x[load], ramp, eased, outside, physics, step)
        inputs[:] = 0.0
        inputs[REFERENCE] = v
        inputs[MOTOR_TORQUE] = outside[EXTERNAL_MOTOR]
        inputs[LOAD_TORQUE] = outside[EXTERNAL_LOAD]
        inputs[STRUCTURE_TORQUE] = outside[EXTERNAL_STRUCTURE]
        copied(inputs, corrected)
        _torques(x, v, slip, yielded, outside, physics, gear, asked, direct, places, inputs)
        advance(transition, forcing, x, inputs, predicted)
        _torques(predicted, v, slip, yielded, outside, physics, gear, asked, direct, places, corrected)
        for i in range(INPUTS):
            inputs[i] = 0.5 * (inputs[i] + corrected[i])
        advance(transition, forcing, x, inputs, predicted)
        motor_bristle = rub(
            predicted, n + motor, motor_response, physics.motor_friction, 0.0, motor_bristle, step
        )
        load_bristle = rub(
            predicted,
            n + load,
            load_response,
            physics.load_friction,
            outside[EXTERNAL_BRAKE],
            load_bristle,
            step,
        )
        turned = predicted[one] - predicted[other] - x[one] + x[other]
        copied(predicted, x)
        slip = slipped(x[one] - x[other], slip, physics, gear)
        yielded = yielding(turned, yielded, physics)
    return w
