"""The linear drive train: motor in its velocity loop, gear compliance, load, structure.

Angles are those of the axis in deg, inertias relative to the load's, torques in deg/s^2 of the load:

    J_m dw_m/dt = k_p (g v - w_m) + k_i x - T + tau_m,   dx/dt = g v - w_m
    dw_l/dt     = T - S + tau_l,                         T = k D + c dD/dt,      D = q_m - q_l
    J_s dw_s/dt = S + tau_s,                             S = k_s E + c_s dE/dt,  E = q_l - q_s

(Gawronski, Modeling and Control of Antennas and Telescopes, doi 10.1007/978-0-387-78793-0, chapters 2 and 3).
An optional appendage, another mass on a spring at load or structure, is the mode that a simulator may lack.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy import linalg, signal

from bayes_hw.arrays import ComplexArray, FloatArray

TORSION, MOTOR_SPEED, SPEED_INTEGRAL, LOAD, LOAD_SPEED, STRUCTURE, STRUCTURE_SPEED, EXTRA, EXTRA_SPEED = (
    range(9)
)
STATES = 9

REFERENCE, MOTOR_TORQUE, LOAD_TORQUE, PAIR_TORQUE, STRUCTURE_TORQUE = range(5)
INPUTS = 5


@dataclass(frozen=True)
class Appendage:
    """A mass on a spring: inertia (the load's is 1), own frequency in Hz, damping ratio, and its host."""

    inertia: float
    frequency_hz: float
    damping_ratio: float
    at_structure: bool = False


@dataclass(frozen=True)
class DriveTrain:
    """Physical parameters: inertias in units of the load's, frequencies in Hz.

    `locked_rotor_hz` is the frequency of load and structure (as one body) on the gear with the motor held,
    `structure_hz` that of the structure with the load held; `loop_bandwidth_hz` = k_p / (2 pi J_m) and
    `loop_integral_hz` = k_i / (2 pi k_p) set the velocity loop; `velocity_gain` is axis speed over command.
    """

    motor_inertia: float
    structure_inertia: float
    locked_rotor_hz: float
    gear_damping_ratio: float
    structure_hz: float
    structure_damping_ratio: float
    loop_bandwidth_hz: float
    loop_integral_hz: float
    velocity_gain: float
    appendage: Appendage | None = None

    @property
    def stiffness(self) -> float:
        """Gear stiffness k in deg/s^2 of the load per deg."""
        return (2 * np.pi * self.locked_rotor_hz) ** 2 * (1 + self.structure_inertia)

    @property
    def gear_damping(self) -> float:
        """Gear damping c in deg/s^2 of the load per deg/s."""
        return 2 * self.gear_damping_ratio * self.stiffness / (2 * np.pi * self.locked_rotor_hz)

    @property
    def loop_gain(self) -> float:
        """k_p in deg/s^2 of the load per deg/s."""
        return 2 * np.pi * self.loop_bandwidth_hz * self.motor_inertia

    @property
    def loop_integral_gain(self) -> float:
        """k_i in deg/s^2 of the load per deg."""
        return 2 * np.pi * self.loop_integral_hz * self.loop_gain

    def state_space(self) -> tuple[FloatArray, FloatArray]:
        """A of shape (9, 9) and B of shape (9, 5) of dx/dt = A x + B (v, torques), in the order above.

        Without an appendage its two states stay at zero.
        """
        a = np.zeros((STATES, STATES))
        b = np.zeros((STATES, INPUTS))
        motor, structure = self.motor_inertia, self.structure_inertia
        a[TORSION, MOTOR_SPEED], a[TORSION, LOAD_SPEED] = 1.0, -1.0
        a[SPEED_INTEGRAL, MOTOR_SPEED] = -1.0
        b[SPEED_INTEGRAL, REFERENCE] = self.velocity_gain
        a[MOTOR_SPEED, MOTOR_SPEED] = -self.loop_gain / motor
        a[MOTOR_SPEED, SPEED_INTEGRAL] = self.loop_integral_gain / motor
        b[MOTOR_SPEED, REFERENCE] = self.loop_gain * self.velocity_gain / motor
        b[MOTOR_SPEED, MOTOR_TORQUE] = 1 / motor
        a[LOAD, LOAD_SPEED] = 1.0
        b[LOAD_SPEED, LOAD_TORQUE] = 1.0
        b[LOAD_SPEED, PAIR_TORQUE], b[MOTOR_SPEED, PAIR_TORQUE] = 1.0, -1 / motor
        b[STRUCTURE_SPEED, STRUCTURE_TORQUE] = 1 / structure
        for row, inertia, sign in ((LOAD_SPEED, 1.0, 1.0), (MOTOR_SPEED, motor, -1.0)):
            a[row, TORSION] += sign * self.stiffness / inertia
            a[row, MOTOR_SPEED] += sign * self.gear_damping / inertia
            a[row, LOAD_SPEED] -= sign * self.gear_damping / inertia
        _attach(
            a,
            (STRUCTURE, STRUCTURE_SPEED),
            (LOAD_SPEED, 1.0),
            structure,
            self.structure_hz,
            self.structure_damping_ratio,
        )
        if self.appendage is not None:
            extra = self.appendage
            host = (STRUCTURE_SPEED, structure) if extra.at_structure else (LOAD_SPEED, 1.0)
            _attach(a, (EXTRA, EXTRA_SPEED), host, extra.inertia, extra.frequency_hz, extra.damping_ratio)
        return a, b

    def step_matrices(self, step_s: float) -> tuple[FloatArray, FloatArray]:
        """exp(A h) of shape (9, 9) and its integral times B, of shape (9, 5): inputs are held over h."""
        a, b = self.state_space()
        block = np.zeros((STATES + INPUTS, STATES + INPUTS))
        block[:STATES, :STATES], block[:STATES, STATES:] = a, b
        exponential = linalg.expm(block * step_s)
        return exponential[:STATES, :STATES].copy(), exponential[:STATES, STATES:].copy()

    def sampled(self, sample_rate_hz: float) -> SampledDrive:
        """Zeros, poles and gain from v, held between samples, to the load's angle."""
        keep = [i for i in range(STATES) if self.appendage is not None or i < EXTRA]
        a, _ = self.state_space()
        transition, forcing = self.step_matrices(1 / sample_rate_hz)
        transition = transition[np.ix_(keep, keep)]
        drive = forcing[keep, REFERENCE]
        continuous = np.linalg.eigvals(a[np.ix_(keep, keep)])
        continuous[np.argmin(np.abs(continuous))] = 0.0
        order = len(keep)
        pencil = np.zeros((order + 1, order + 1))
        pencil[:order, :order], pencil[:order, order], pencil[order, LOAD] = transition, drive, 1.0
        mass = np.diag(np.append(np.ones(order), 0.0))
        zeros = np.asarray(linalg.eigvals(pencil, mass), dtype=np.complex128)
        zeros = zeros[np.isfinite(zeros) & (np.abs(zeros) < LARGEST_ZERO)]
        return SampledDrive(zeros, np.exp(continuous / sample_rate_hz), float(drive[LOAD]))

    def twist(self, v: FloatArray, sample_rate_hz: float) -> FloatArray:
        """Angle of the gear's compliance, q_m - q_l in deg, for a reference v held between samples."""
        transition, forcing = self.step_matrices(1 / sample_rate_hz)
        shown = np.eye(STATES)[[TORSION]]
        system = (transition, forcing[:, [REFERENCE]], shown, np.zeros((1, 1)), 1 / sample_rate_hz)
        return np.asarray(signal.dlsim(system, v)[1][:, 0], dtype=np.float64)

    def modes(self) -> list[tuple[float, float]]:
        """Frequency in Hz and damping ratio of every lightly damped pole pair, in order of frequency."""
        keep = [i for i in range(STATES) if self.appendage is not None or i < EXTRA]
        a, _ = self.state_space()
        poles = np.linalg.eigvals(a[np.ix_(keep, keep)])
        light = [(abs(s) / (2 * np.pi), -s.real / abs(s)) for s in poles if s.imag > 0]
        return sorted((float(f), float(z)) for f, z in light if z < LIGHT_DAMPING)


LIGHT_DAMPING = 0.3
LARGEST_ZERO = 1e6


class SampledDrive(NamedTuple):
    """G(z) = gain prod(z - zeros) / prod(z - poles)."""

    zeros: ComplexArray
    poles: ComplexArray
    gain: float


def draw_drive_train(
    rng: np.random.Generator,
    diameter_m: tuple[float, float],
    first_damping: tuple[float, float] = (0.01, 0.10),
) -> DriveTrain:
    """A dish of a diameter drawn (log-uniformly) from the range in m, with its drive.

    Locked-rotor frequency 20 D^-0.7 Hz within 15 % (the trend of existing dishes: Gawronski, chapter 2, and
    NASA's 34 m antennas at 2 Hz), structure 1.6 to 2.3 times that, structural and gear damping 0.5 to 3 %,
    and a velocity loop of 25 to 60 Hz whose integral acts from 1.6 to 2.8 Hz, slower on slower
    dishes. Draws whose first mode the loop damps less or more than `first_damping` says are repeated.
    """
    while True:
        diameter = float(np.exp(rng.uniform(*np.log(diameter_m))))
        locked = 20 * diameter**-0.7 * rng.uniform(0.85, 1.15)
        drive = DriveTrain(
            motor_inertia=float(np.exp(rng.uniform(np.log(0.3), np.log(3.0)))),
            structure_inertia=float(rng.uniform(0.18, 0.42)),
            locked_rotor_hz=float(locked),
            gear_damping_ratio=float(rng.uniform(0.005, 0.03)),
            structure_hz=float(locked * rng.uniform(1.6, 2.3)),
            structure_damping_ratio=float(rng.uniform(0.005, 0.03)),
            loop_bandwidth_hz=float(rng.uniform(25, 60) * min(1.0, locked / 1.7)),
            loop_integral_hz=float(rng.uniform(1.7, 2.8) * min(1.0, locked / 1.7)),
            velocity_gain=float(rng.uniform(0.33, 1.25)),
        )
        modes = drive.modes()
        least, most = first_damping
        if len(modes) == 2 and least < modes[0][1] < most and modes[1][1] < 0.06:
            return drive


def _attach(
    a: FloatArray,
    rows: tuple[int, int],
    host: tuple[int, float],
    inertia: float,
    frequency_hz: float,
    damping_ratio: float,
) -> None:
    """Hang a mass on a spring to the body at row `host[0]` of inertia `host[1]`; its angle is relative."""
    angle, speed = rows
    body, body_inertia = host
    omega = 2 * np.pi * frequency_hz
    a[angle, speed], a[angle, body] = 1.0, -1.0
    for row, factor in ((speed, -1.0), (body, inertia / body_inertia)):
        a[row, angle] += factor * omega**2
        a[row, speed] += factor * 2 * damping_ratio * omega
        a[row, body] -= factor * 2 * damping_ratio * omega
