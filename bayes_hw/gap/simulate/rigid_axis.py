"""A rigid axis driven by force: one mass, in open loop or under its position controller."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.gap.case.simulator import Force
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Identity, Logarithm, LogNormal, Normal
from bayes_hw.record import Units

MASS_LOG_SD = 0.1


@dataclass(frozen=True)
class PositionController:
    """u = Kv (Kp (reference - position) - velocity), limited; velocity by backward difference.

    Proportional position loop around a proportional velocity loop, as on the EMPS (Janot, Gautier, Brunot,
    Workshop on Nonlinear System Identification Benchmarks 2019). `proportional` Kp in 1/s, `velocity_gain` Kv
    in command units per output unit a second, `limit` in command units; it runs at `rate_hz`, and the
    reference between samples of a record is taken to be a straight line.
    """

    proportional: float
    velocity_gain: float
    limit: float
    rate_hz: float


@dataclass(frozen=True)
class RigidAxis:
    """mass x'' = force_gain u + mass a(x, x'), frictionless: u is the record's command or the controller's.

    With a `controller` the record's command is the reference position. `mass` is nominal and re-estimated,
    `force_gain` (force a command unit) known. `start_speed` is the standard deviation, in output units a
    second, of the speed that a record starts with, which is estimated; it starts at position zero. Friction
    and ripple are implicit within a step, so that sticking is exact (time stepping of Moreau,
    doi 10.1007/978-3-7091-2624-0_1).
    """

    name: str
    mass: float
    force_gain: float
    sample_rate_hz: float
    start_speed: float
    controller: PositionController | None = None
    mass_unit: str = "kg"
    units: Units = field(default_factory=Units)
    noise_sigma: float = float("nan")
    force_door: bool = True

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        prior = LogNormal(self.mass, MASS_LOG_SD)
        speed = f"{self.units.output}/s"
        return (
            Parameter("mass", self.mass_unit, self.mass, prior, Logarithm()),
            Parameter("start.speed", speed, 0.0, Normal(0.0, self.start_speed), Identity()),
        )

    @property
    def _step_rate(self) -> float:
        return self.sample_rate_hz if self.controller is None else self.controller.rate_hz

    def simulate(self, values: FloatArray, inputs: FloatArray, force: Force | None = None) -> FloatArray:
        """Positions (batch, samples) for values (batch, parameters) and commands (samples,)."""
        steps = max(1, round(self._step_rate / self.sample_rate_hz))
        settings = np.tile(S.NEUTRAL, (len(values), 1)) if force is None else force.settings
        known = np.zeros(len(inputs)) if force is None or force.signal is None else force.signal
        loop = np.zeros(3)
        if self.controller is not None:
            loop[:] = self.controller.proportional, self.controller.velocity_gain, self.controller.limit
        outputs = np.empty((len(values), len(inputs)))
        for row, (mass, speed) in enumerate(values):
            move(
                np.ascontiguousarray(inputs, np.float64),
                self.force_gain / mass,
                float(speed),
                loop,
                1 / (self.sample_rate_hz * steps),
                steps,
                known,
                settings[row],
                outputs[row],
            )
        return outputs


@compiled_inside
def _slowed(free, h, s):  # type: ignore[no-untyped-def]
    """Speed at the end of a step h that would end at speed `free` without friction."""
    side = 1.0 if free > 0 else -1.0
    viscous = s[S.VISCOUS] * (1 + side * s[S.VISCOUS_ASYMMETRY])
    end, found = free, free
    for _ in range(1 if s[S.MOTOR_STATIC] == 0 else 6):
        curve = 1 + s[S.MOTOR_STATIC] * np.exp(-((end / s[S.MOTOR_STRIBECK_SPEED]) ** 2))
        sliding = s[S.MOTOR_FRICTION] * (1 + side * s[S.MOTOR_ASYMMETRY]) * curve
        slow = free / (1 + h * (viscous + sliding / s[S.MOTOR_SMOOTHING]))
        fast = (free - side * h * sliding) / (1 + h * viscous)
        found = slow if abs(slow) < s[S.MOTOR_SMOOTHING] else fast
        end = 0.5 * (end + found)
    return found


@compiled(nogil=True)
def move(u, gain, speed, loop, h, steps, known, s, position):  # type: ignore[no-untyped-def]
    """Fill `position` (samples,) of the commands or references u, `steps` steps of h a sample.

    `gain` is force gain over mass, `loop` holds Kp, Kv and the limit (Kv = 0: open loop), `known` a known
    acceleration, s the settings of friction and ripple.
    """
    x, v, before = 0.0, speed, -speed * h
    closed = loop[1] != 0
    for k in range(len(u)):
        position[k] = x
        after = u[k + 1] if k + 1 < len(u) else u[k]
        for j in range(steps):
            command = u[k]
            if closed:
                reference = u[k] + (after - u[k]) * j / steps
                command = loop[1] * (loop[0] * (reference - x) - (x - before) / h)
                command = min(max(command, -loop[2]), loop[2])
            acceleration = gain * command + known[k]
            if s[S.RIPPLE] != 0:
                angle = 2 * np.pi * x / s[S.RIPPLE_PERIOD] + s[S.RIPPLE_PHASE]
                acceleration += s[S.RIPPLE] * np.sin(angle) + s[S.RIPPLE_START]
            end = _slowed(v + h * acceleration, h, s)
            before = x
            x += 0.5 * h * (v + end)
            v = end
