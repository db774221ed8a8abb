"""The axis with effects, slowly: its equations of motion in state space, in steps of 0.2 ms.

Torques are taken from the motion at the start of every step, the command as a continuous function of time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import copysign, cos, exp, floor, sin

import numpy as np
from drive_axis import LOAD_SPEED, MOTOR_ANGLE, MOTOR_SPEED, TRAIN, W, held

from bayes_hw.arrays import FloatArray

STEP = 2e-4

Torques = Callable[[FloatArray], tuple[float, float]]
"""(w, motor angle, motor speed, load speed) -> torques on motor and load."""


def no_torques(motion: FloatArray) -> tuple[float, float]:  # noqa: ARG001
    return 0.0, 0.0


@dataclass
class Setting:
    """What differs from the linear axis; functions of time in s and of w."""

    torques: Torques = no_torques
    resonator: tuple[float, float, float] | None = None
    on_structure: bool = False
    extra_delay: float = 0.0
    command_rate: float = np.inf
    limits_at: Callable[[float], float] | None = None
    gain_at: Callable[[float], float] = lambda t: 1.0  # noqa: ARG005
    bias: float = 0.0
    fine: bool = True


def slow_w(
    u: FloatArray, rate: float, delay: int, lower: float, upper: float, setting: Setting
) -> FloatArray:
    """w (samples,) from rest; the gain changes at samples, the rest within them."""
    substeps = round(1 / (rate * STEP)) if setting.fine else 1
    h = 1 / (rate * substeps)
    a, b, c = TRAIN.state_space(setting.resonator, setting.on_structure)
    step = np.hstack(held(a, b, h))
    whole, w = np.zeros(step.shape[1]), np.zeros(len(u))
    x, force = whole[: len(a)], whole[len(a) :]
    followed, swing = 0.0, 1.0
    for k in range(len(u)):
        w[k] = c[W] @ x
        gain = setting.gain_at(k / rate)
        for j in range(substeps):
            if setting.limits_at is not None:
                swing = setting.limits_at(float(c[W] @ x))
            index = floor(k + j / substeps - delay - setting.extra_delay + 1e-9)
            command = float(u[index]) if index >= 0 else 0.0
            if setting.command_rate < np.inf:
                reach = setting.command_rate * h
                followed += min(max(command - followed, -reach), reach)
                command = followed
            force[0] = gain * min(max(command, lower * swing), upper * swing) + setting.bias
            if setting.torques is not no_torques:
                force[1:] = setting.torques(c @ x)
            x[:] = step @ whole
    return w


def coulomb(torque: float, smoothing: float, where: int) -> Torques:
    """-torque sign(speed), proportional to speed below `smoothing`; at motor or load by the speed's row."""

    def torques(motion: FloatArray) -> tuple[float, float]:
        rub = -torque * min(max(motion[where] / smoothing, -1.0), 1.0)
        return (rub, 0.0) if where == MOTOR_SPEED else (0.0, rub)

    return torques


def stribeck(
    torque: float, excess: float, speed: float, smoothing: float, where: int = MOTOR_SPEED
) -> Torques:
    def torques(motion: FloatArray) -> tuple[float, float]:
        v = motion[where]
        size = torque * (1 + excess * exp(-((v / speed) ** 2)))
        rub = -size * min(max(v / smoothing, -1.0), 1.0)
        return (rub, 0.0) if where == MOTOR_SPEED else (0.0, rub)

    return torques


def dahl(
    torque: float, stiffness: float, excess: float = 0.0, speed: float = 1.0, where: int = MOTOR_SPEED
) -> Torques:
    """z' = v - |v| stiffness z / g(v), and -stiffness z; g Stribeck's curve."""
    z = 0.0

    def torques(motion: FloatArray) -> tuple[float, float]:
        nonlocal z
        v = motion[where]
        level = torque * (1 + excess * exp(-((v / speed) ** 2)))
        z += STEP * (v - abs(v) * stiffness * z / level)
        return (-stiffness * z, 0.0) if where == MOTOR_SPEED else (0.0, -stiffness * z)

    return torques


def ripple(amplitude: float, period: float, phase: float) -> Torques:
    """Zero at rest."""

    def torques(motion: FloatArray) -> tuple[float, float]:
        x = 2 * np.pi * motion[MOTOR_ANGLE] / period
        return amplitude * (sin(x + phase) - sin(phase)), 0.0

    return torques


def overtone(values: tuple[float, ...], where: str) -> Torques:
    """A sine of the angle with second harmonic and constant, at motor, load or gear mesh."""
    sine, cosine, period, second_sine, second_cosine, constant = values

    def torques(motion: FloatArray) -> tuple[float, float]:
        x = 2 * np.pi * motion[W if where == "load" else MOTOR_ANGLE] / period
        torque = sine * sin(x) + cosine * (cos(x) - 1) + constant
        torque += second_sine * sin(2 * x) + second_cosine * (cos(2 * x) - 1)
        on_motor = -TRAIN.km / TRAIN.kl * torque if where == "mesh" else torque
        return (0.0 if where == "load" else on_motor), (0.0 if where == "motor" else torque)

    return torques


def spring(torsion_torque: Callable[[float, float], float]) -> Torques:
    """The compliance's torque per stiffness in place of phi + c phi'."""

    def torques(motion: FloatArray) -> tuple[float, float]:
        phi, rate = motion[MOTOR_ANGLE] - motion[W], motion[MOTOR_SPEED] - motion[LOAD_SPEED]
        more = torsion_torque(phi, rate) - (phi + TRAIN.c * rate)
        return -TRAIN.km * more, TRAIN.kl * more

    return torques


def stiffening(cubic: float) -> Torques:
    return spring(lambda phi, rate: phi + cubic * phi**3 + TRAIN.c * rate)


def softening(amount: float) -> Torques:
    return spring(lambda phi, rate: phi / (1 + amount * phi**2) + TRAIN.c * rate)


def free_gap(half_gap: float) -> Torques:
    """No torque inside the gap, spring and damper beyond."""

    def torque(phi: float, rate: float) -> float:
        if abs(phi) < half_gap:
            return 0.0
        return phi - copysign(half_gap, phi) + TRAIN.c * rate

    return spring(torque)
