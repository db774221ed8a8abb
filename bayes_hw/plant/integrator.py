"""The differential equations of the axis, faults included, in steps of a millisecond or less.

One step integrates the linear part exactly (matrix exponential, inputs held) and the nonlinear torques by
Heun's rule on top of it (exponential time differencing, Cox and Matthews, doi 10.1006/jcph.2002.6995, without
their higher stages). Dry friction is a set-valued force: the torque that would stop the body within the step,
limited to what friction can give, so that it sticks exactly (Moreau's time stepping,
doi 10.1007/978-3-7091-2624-0_1); bristles bend at the speed at which the step ends.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.plant.drive_train import (
    INPUTS,
    LOAD,
    LOAD_SPEED,
    LOAD_TORQUE,
    MOTOR_SPEED,
    MOTOR_TORQUE,
    PAIR_TORQUE,
    REFERENCE,
    SPEED_INTEGRAL,
    STATES,
    STRUCTURE_TORQUE,
    TORSION,
)

EXTERNAL_MOTOR, EXTERNAL_LOAD, EXTERNAL_STRUCTURE, EXTERNAL_BRAKE, EXTERNAL_GAIN, EXTERNAL_BIAS = range(6)
EXTERNAL_OIL, EXTERNAL_LOST = 6, 7
EXTERNALS = 8

BISECTIONS = 40
"""For the speed at which a step with bristles ends."""


class Friction(NamedTuple):
    """Dry friction of one body; torques in deg/s^2 of the load.

    Stribeck curve g(w) = coulomb + (static - coulomb) exp(-(w / stribeck_speed)^2). With `bristle_stiffness`
    above zero the friction is LuGre's: dz/dt = w - stiffness |w| z / g(w), torque = stiffness z +
    damping dz/dt (Canudas de Wit et al., doi 10.1109/9.376053).
    """

    coulomb: float = 0.0
    static: float = 0.0
    stribeck_speed: float = 1.0
    bristle_stiffness: float = 0.0
    bristle_damping: float = 0.0


class Wave(NamedTuple):
    """amplitude (sin(k q + phase) + second sin(2 k q + phase) - its value at 0), k = 2 pi / period in deg.

    That of the limits is not zero at 0: they vary about those of the axis.
    """

    amplitude: float = 0.0
    wavenumber: float = 0.0
    phase: float = 0.0
    second: float = 0.0


class Physics(NamedTuple):
    """What is nonlinear in the axis; the defaults are none of it. Angles in deg, speeds in deg/s."""

    lower: float
    upper: float
    limit_wave: Wave = Wave()
    limit_slope: float = 0.0
    rate_limit: float = np.inf
    rate_limit_first: float = 0.0
    recovery_s: float = 0.0
    curvature: float = 0.0
    forward_gain: float = 0.0
    motor_friction: Friction = Friction()
    load_friction: Friction = Friction()
    play_half_gap: float = 0.0
    gear_half_gap: float = 0.0
    cubic: float = 0.0
    stiffness_wave: Wave = Wave()
    slip_torque: float = np.inf
    yield_angle: float = 0.0
    yield_share: float = 0.0
    motor_ripple: Wave = Wave()
    mesh_ripple: Wave = Wave()
    load_ripple: Wave = Wave()
    current_limit: float = np.inf
    drag: float = 0.0
    wrap_begin: float = 0.0
    wrap_stiffness: float = 0.0


class Gear(NamedTuple):
    """Stiffness and damping of the gear and gains of the loop, for the torques that the faults correct."""

    stiffness: float
    damping: float
    loop_gain: float
    integral_gain: float
    velocity_gain: float


@compiled_inside  # type: ignore[untyped-decorator]
def wave_value(wave: Wave, angle: float) -> float:
    if wave.amplitude == 0.0:
        return 0.0
    x = wave.wavenumber * angle
    value = math.sin(x + wave.phase) - math.sin(wave.phase)
    return wave.amplitude * (value + wave.second * (math.sin(2 * x + wave.phase) - math.sin(wave.phase)))


@compiled_inside  # type: ignore[untyped-decorator]
def _limited(command: float, angle: float, physics: Physics) -> float:
    wave = physics.limit_wave
    factor = 1.0 + physics.limit_slope * angle
    factor += wave.amplitude * math.sin(wave.wavenumber * angle + wave.phase)
    factor = max(factor, 0.05)
    return min(max(command, physics.lower * factor), physics.upper * factor)


@compiled_inside  # type: ignore[untyped-decorator]
def _ramped(target: float, previous: float, largest: float) -> float:
    return previous + min(max(target - previous, -largest), largest)


@compiled_inside  # type: ignore[untyped-decorator]
def gear_correction(
    twist: float, twist_rate: float, angle: float, slip: float, yielded: float, physics: Physics, gear: Gear
) -> float:
    """Torque of the real gear minus that of the linear one, motor on load, at an angle of the load."""
    linear = gear.stiffness * twist + gear.damping * twist_rate
    free = twist - slip
    rate = twist_rate
    if physics.gear_half_gap > 0.0:
        if free > physics.gear_half_gap:
            free -= physics.gear_half_gap
        elif free < -physics.gear_half_gap:
            free += physics.gear_half_gap
        else:
            free, rate = 0.0, 0.0
    stiffening = physics.cubic * free * free
    factor = 1.0 + stiffening if physics.cubic >= 0.0 else 1.0 / (1.0 - stiffening)
    factor *= 1.0 + wave_value(physics.stiffness_wave, angle)
    elastic = gear.stiffness * (factor * free + physics.yield_share * (yielded - free))
    return elastic + gear.damping * rate - linear + wave_value(physics.mesh_ripple, angle + twist)


@compiled_inside  # type: ignore[untyped-decorator]
def _torques(
    x: FloatArray,
    v: float,
    slip: float,
    yielded: float,
    outside: FloatArray,
    physics: Physics,
    gear: Gear,
    inputs: FloatArray,
) -> None:
    """The smooth torques of the faults at state x, added to `inputs`."""
    inputs[MOTOR_TORQUE] += wave_value(physics.motor_ripple, x[LOAD] + x[TORSION])
    inputs[LOAD_TORQUE] += wave_value(physics.load_ripple, x[LOAD])
    twist_rate = x[MOTOR_SPEED] - x[LOAD_SPEED]
    inputs[PAIR_TORQUE] += gear_correction(x[TORSION], twist_rate, x[LOAD], slip, yielded, physics, gear)
    inputs[LOAD_TORQUE] -= resistance(x[LOAD], x[LOAD_SPEED], outside, physics)
    error = gear.velocity_gain * v - x[MOTOR_SPEED]
    asked = gear.loop_gain * error + gear.integral_gain * x[SPEED_INTEGRAL]
    inputs[MOTOR_TORQUE] += demand_correction(asked, outside, physics)


@compiled_inside  # type: ignore[untyped-decorator]
def resistance(angle: float, speed: float, outside: FloatArray, physics: Physics) -> float:
    """The torque that oil, air and cables hold against the load."""
    torque = (outside[EXTERNAL_OIL] + physics.drag * abs(speed)) * speed
    if physics.wrap_stiffness > 0.0:
        inside = min(max(angle, -physics.wrap_begin), physics.wrap_begin)
        torque += physics.wrap_stiffness * (angle - inside)
    return torque


@compiled_inside  # type: ignore[untyped-decorator]
def demand_correction(asked: float, outside: FloatArray, physics: Physics) -> float:
    """The torque that the amplifier gives minus the one that the loop asks for."""
    given = (1.0 - outside[EXTERNAL_LOST]) * asked
    return min(max(given, -physics.current_limit), physics.current_limit) - asked


@compiled_inside  # type: ignore[untyped-decorator]
def driven(
    asked: float,
    angle: float,
    ramp: float,
    eased: float,
    outside: FloatArray,
    physics: Physics,
    step: float,
) -> tuple[float, float, float]:
    """Reference of the drive behind ramp, limiter and gain, and the new states of ramp and recovery."""
    if physics.rate_limit_first > 0.0:
        ramp = _ramped(asked, ramp, physics.rate_limit * step)
        asked = ramp
    limited = _limited(asked, angle, physics)
    if physics.rate_limit_first == 0.0:
        ramp = _ramped(limited, ramp, physics.rate_limit * step)
        limited = ramp
    if physics.recovery_s > 0.0:
        eased = (
            limited if limited != asked else eased + (limited - eased) * min(1.0, step / physics.recovery_s)
        )
        limited = eased
    forward = physics.forward_gain if limited > 0.0 else 0.0
    factor = 1.0 + outside[EXTERNAL_GAIN] + physics.curvature * abs(limited) + forward
    return limited * factor + outside[EXTERNAL_BIAS], ramp, eased


@compiled_inside  # type: ignore[untyped-decorator]
def slipped(twist: float, slip: float, physics: Physics, gear: Gear) -> float:
    """Where wheels have slid to at this twist."""
    if physics.slip_torque == np.inf:
        return slip
    widest = physics.slip_torque / gear.stiffness
    return min(max(slip, twist - widest), twist + widest)


@compiled_inside  # type: ignore[untyped-decorator]
def yielding(turned: float, yielded: float, physics: Physics) -> float:
    """Bouc and Wen's hidden deflection after the twist has `turned`."""
    if physics.yield_angle <= 0.0:
        return yielded
    ratio = yielded / physics.yield_angle
    sense = 1.0 if turned * yielded > 0.0 else 0.0
    return yielded + turned * (1.0 - sense * ratio * ratio)


@compiled_inside  # type: ignore[untyped-decorator]
def _sliding(speed: float, friction: Friction) -> float:
    """Stribeck's curve."""
    if friction.static <= friction.coulomb:
        return friction.coulomb
    fallen = math.exp(-((speed / friction.stribeck_speed) ** 2))
    return friction.coulomb + (friction.static - friction.coulomb) * fallen


@compiled_inside  # type: ignore[untyped-decorator]
def _lugre(speed: float, friction: Friction, bristle: float, step: float) -> tuple[float, float]:
    """Torque and deflection of bristles at the end of a step that ends at `speed`."""
    relaxation = friction.bristle_stiffness * abs(speed) / _sliding(speed, friction)
    new = (bristle + step * speed) / (1.0 + step * relaxation)
    return -friction.bristle_stiffness * new - friction.bristle_damping * (new - bristle) / step, new


@compiled  # type: ignore[untyped-decorator]
def rub(
    x: FloatArray,
    speed: int,
    response: FloatArray,
    friction: Friction,
    extra: float,
    bristle: float,
    step: float,
) -> float:
    """Apply dry friction to the body whose speed is x[speed], whose answer to unit torque over the step is
    `response`; the new bristle deflection.

    Bristles bend at the speed at the end of the step, which their own torque decides: that of a body without
    friction would have them slide while it sticks.
    """
    free, answer = x[speed], response[speed]
    if friction.bristle_stiffness > 0.0 and friction.coulomb > 0.0:
        reach = answer * (friction.bristle_stiffness + friction.bristle_damping / step)
        reach *= abs(bristle) + step * abs(free) + friction.static / friction.bristle_stiffness
        low, high = free - reach, free + reach
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            if middle - free - answer * _lugre(middle, friction, bristle, step)[0] > 0.0:
                high = middle
            else:
                low = middle
        torque, new = _lugre(0.5 * (low + high), friction, bristle, step)
    else:
        new = 0.0
        level = _sliding(free, friction) + extra
        if level == 0.0:
            return new
        torque = min(max(-free / answer, -level), level)
    for i in range(len(x)):
        x[i] += response[i] * torque
    return new


@compiled  # type: ignore[untyped-decorator]
def integrate(
    transition: FloatArray,
    forcing: FloatArray,
    command: FloatArray,
    external: FloatArray,
    physics: Physics,
    gear: Gear,
    step: float,
) -> FloatArray:
    """The angle after the play, w, at every step from rest at zero; shape (steps,).

    `command` of shape (steps,) is the delayed velocity command; `external` of shape (steps, 8) or (1, 8)
    holds torques on motor, load and structure, the friction level of a brake at the load, gain minus one and
    bias of the drive's reference, the viscous drag of the load in 1/s, and the share of the motor's torque
    that is lost. `transition` (9, 9) and `forcing` (9, 5) belong to `step` in s.
    """
    steps = len(command)
    w = np.empty(steps)
    x, predicted = np.zeros(STATES), np.zeros(STATES)
    inputs, corrected = np.zeros(INPUTS), np.zeros(INPUTS)
    motor_response, load_response = forcing[:, MOTOR_TORQUE].copy(), forcing[:, LOAD_TORQUE].copy()
    motor_bristle = load_bristle = slip = yielded = out = 0.0
    ramp = eased = 0.0
    for k in range(steps):
        play = physics.play_half_gap
        out = min(max(out, x[LOAD] - play), x[LOAD] + play)
        w[k] = out
        outside = external[min(k, len(external) - 1)]
        v, ramp, eased = driven(command[k], x[LOAD], ramp, eased, outside, physics, step)

        inputs[REFERENCE] = v
        inputs[MOTOR_TORQUE] = outside[EXTERNAL_MOTOR]
        inputs[LOAD_TORQUE] = outside[EXTERNAL_LOAD]
        inputs[PAIR_TORQUE] = 0.0
        inputs[STRUCTURE_TORQUE] = outside[EXTERNAL_STRUCTURE]
        copied(inputs, corrected)
        _torques(x, v, slip, yielded, outside, physics, gear, inputs)
        advance(transition, forcing, x, inputs, predicted)
        _torques(predicted, v, slip, yielded, outside, physics, gear, corrected)
        for i in range(INPUTS):
            inputs[i] = 0.5 * (inputs[i] + corrected[i])
        advance(transition, forcing, x, inputs, predicted)
        motor_bristle = rub(
            predicted, MOTOR_SPEED, motor_response, physics.motor_friction, 0.0, motor_bristle, step
        )
        load_bristle = rub(
            predicted,
            LOAD_SPEED,
            load_response,
            physics.load_friction,
            outside[EXTERNAL_BRAKE],
            load_bristle,
            step,
        )
        turned = predicted[TORSION] - x[TORSION]
        copied(predicted, x)
        slip = slipped(x[TORSION], slip, physics, gear)
        yielded = yielding(turned, yielded, physics)
    return w


@compiled_inside  # type: ignore[untyped-decorator]
def copied(values: FloatArray, to: FloatArray) -> None:
    """`to` = values; as a slice that is assigned, numba compiles the words of its errors too, for seconds."""
    for i in range(len(values)):
        to[i] = values[i]


@compiled_inside  # type: ignore[untyped-decorator]
def advance(
    transition: FloatArray, forcing: FloatArray, x: FloatArray, inputs: FloatArray, new: FloatArray
) -> None:
    """`new` = transition x + forcing inputs."""
    for i in range(len(x)):
        total = 0.0
        for j in range(len(x)):
            total += transition[i, j] * x[j]
        for j in range(len(inputs)):
            total += forcing[i, j] * inputs[j]
        new[i] = total
