"""A record of a MuJoCo axis: the loop and the applied torques around mj_step."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.plant.foreign.train import COM_OFFSET_M, STEPS_PER_SECOND, Train
from bayes_hw.plant.integrator import EXTERNAL_BIAS, EXTERNAL_GAIN, EXTERNAL_LOAD, EXTERNAL_STRUCTURE
from bayes_hw.plant.run import RecordRun

AppliedTorque: TypeAlias = Callable[[int, Any, Any, Any], None]
"""law(step, angles, speeds, torques): adds to the torques (bodies,) in place; rad, rad/s, N m."""

FASTEST_SPRING = 12.0
"""Steps in a radian of the fastest spring's swing, at least."""


def mujoco() -> ModuleType:
    """The package; raises InputError where it is not installed."""
    try:
        import mujoco as found
    except ImportError:
        raise InputError("MuJoCo is not installed; pip install bayes-hw[mujoco]") from None
    return found


@dataclass(frozen=True)
class ForeignAxis:
    """Limiter (deg/s), drive train and the dead zone (deg) of the output."""

    train: Train
    lower: float
    upper: float
    dead_zone: float
    delay_samples: int
    sample_rate_hz: float
    substeps: int

    @property
    def step_s(self) -> float:
        return 1 / (self.sample_rate_hz * self.substeps)

    @cached_property
    def mechanism(self) -> Any:
        """The compiled model of the axis without faults."""
        return mujoco().MjModel.from_xml_string(self.train.mjcf(self.step_s))


def substeps_for(train: Train, rate_hz: float) -> int:
    """Physics steps in a sample: enough for the fastest spring with both of its ends free."""
    fastest = max(
        (
            np.sqrt(s.stiffness * (1 / train.inertias[s.one] + 1 / train.inertias[s.other]))
            for s in train.springs
        ),
        default=0.0,
    )
    return math.ceil(max(STEPS_PER_SECOND, FASTEST_SPRING * float(fastest)) / rate_hz)


@dataclass
class ForeignRun(RecordRun):
    """What the faults have changed in the mechanism and its loop.

    `dry_friction` is N m by body, `gaps` half gaps in rad by spring; `torque_limits` N m, one value or one
    a step; `tachometer` gives the factor on the measured speed at a motor angle; `gravity` (m/s^2) acts at an
    angle (rad) from the load's centre of mass; `stops` are the load's, rad; `encoder` changes the angles
    (steps,) in deg that are read.
    """

    axis: ForeignAxis
    train: Train = field(init=False)
    dry_friction: dict[int, float] = field(default_factory=dict)
    gaps: dict[int, float] = field(default_factory=dict)
    torques: list[AppliedTorque] = field(default_factory=list)
    torque_limits: FloatArray | None = None
    torque_dead_band: float = 0.0
    tachometer: Callable[[float], float] | None = None
    gravity: tuple[float, float] | None = None
    stops: tuple[float, float] | None = None
    encoder: Callable[[FloatArray], FloatArray] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        self.train = self.axis.train

    def angles(self) -> FloatArray:
        """The angle in deg that the encoder's disc has, at every physics step (steps,)."""
        package = mujoco()
        fresh = self.train is not self.axis.train
        model = (
            package.MjModel.from_xml_string(self.train.mjcf(self.axis.step_s))
            if fresh or self.dry_friction or self.gaps or self.gravity or self.stops
            else self.axis.mechanism
        )
        for body, torque in self.dry_friction.items():
            model.dof_frictionloss[body] = torque
        for spring, half_gap in self.gaps.items():
            model.tendon_lengthspring[spring] = -half_gap, half_gap
        trim = 0.0
        if self.gravity is not None:
            size, angle = self.gravity
            model.opt.gravity[:] = size * math.cos(angle), size * math.sin(angle), 0.0
            trim = -1e-3 * COM_OFFSET_M * size * math.sin(angle)
        if self.stops is not None:
            model.jnt_limited[self.train.load] = 1
            model.jnt_range[self.train.load] = self.stops
            model.jnt_solref[self.train.load] = 0.1, 1.0
        found = self._integrated(package, model, trim)
        return found if self.encoder is None else self.encoder(found)

    def _integrated(self, package: ModuleType, model: Any, trim: float) -> FloatArray:
        data, step = package.MjData(model), package.mj_step
        q, speed, torques = data.qpos, data.qvel, data.qfrc_applied
        train, loop, dt = self.train, self.train.loop, self.axis.step_s
        motor, load, read = train.motor, train.load, train.encoder
        commands = self._command_source()
        scale = np.pi / 180
        outside_load = scale * self.external[:, EXTERNAL_LOAD] * train.inertias[load]
        outside_dish = scale * self.external[:, EXTERNAL_STRUCTURE] * train.inertias[train.dish]
        blown = bool(outside_load.any() or outside_dish.any())
        laws = list(self.torques)
        w = np.empty(self.steps)
        integral = slow_speed = slow_v = current = 0.0
        share = dt / loop.filter_s
        lag = 1.0 if loop.current_s <= 0 else -math.expm1(-dt / loop.current_s)
        limits = self.torque_limits
        for k in range(self.steps):
            angle = float(q[read])
            w[k] = angle
            v = scale * commands(k, float(q[load]) / scale)
            own = float(speed[motor])
            measured = own if self.tachometer is None else own * self.tachometer(float(q[motor]))
            error = v - measured
            asked = loop.kp * error + loop.ki * integral
            if loop.kd:
                asked -= loop.kd * (measured - slow_speed) / loop.filter_s
                slow_speed += share * (measured - slow_speed)
            if loop.ff:
                asked += loop.ff * (v - slow_v) / loop.filter_s
                slow_v += share * (v - slow_v)
            integral += dt * error
            if self.torque_dead_band:
                asked = math.copysign(max(abs(asked) - self.torque_dead_band, 0.0), asked)
            if limits is not None:
                largest = float(limits[min(k, len(limits) - 1)])
                asked = min(max(asked, -largest), largest)
            current += lag * (asked - current)
            torques[:] = 0.0
            torques[motor] = current
            if trim:
                torques[load] += trim
            if blown:
                torques[load] += outside_load[k]
                torques[train.dish] += outside_dish[k]
            for law in laws:
                law(k, q, speed, torques)
            step(model, data)
        return np.asarray(w / scale)

    def _command_source(self) -> Callable[[int, float], float]:
        """v in deg/s at a step and an angle of the load in deg, after limiter and ramp."""
        asked, physics, dt = self.delayed(), self.physics, self.axis.step_s
        gain, bias = 1 + self.external[:, EXTERNAL_GAIN], self.external[:, EXTERNAL_BIAS]
        wave = physics.limit_wave
        moving = wave.amplitude != 0.0 or physics.limit_slope != 0.0
        if not moving:
            if physics.rate_limit_first > 0.0:
                asked = _ramped(asked, physics.rate_limit * dt)
            limited = np.clip(asked, physics.lower, physics.upper)
            if physics.rate_limit_first == 0.0 and math.isfinite(physics.rate_limit):
                limited = _ramped(limited, physics.rate_limit * dt)
            ready = limited * gain + bias
            return lambda k, angle: float(ready[k])  # noqa: ARG005

        def at(k: int, angle: float) -> float:
            factor = 1.0 + physics.limit_slope * angle
            factor += wave.amplitude * math.sin(wave.wavenumber * angle + wave.phase)
            factor = max(factor, 0.05)
            limited = min(max(float(asked[k]), physics.lower * factor), physics.upper * factor)
            return limited * float(gain[k]) + float(bias[k])

        return at


def _ramped(target: FloatArray, largest: float) -> FloatArray:
    """The target (steps,) followed by at most `largest` a step."""
    found, value = np.empty_like(target), 0.0
    for k, wanted in enumerate(target.tolist()):
        value += min(max(wanted - value, -largest), largest)
        found[k] = value
    return found
