"""The velocity loop and the current loops around the mechanics, as one linear system in continuous time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.beam.mechanism import Mechanism
from bayes_hw.plant.effects.effect import log_uniform

REFERENCE, MOTOR_TORQUE, LOAD_TORQUE, PAIR_TORQUE, STRUCTURE_TORQUE, DEMAND = range(6)
INPUTS = 6


@dataclass(frozen=True)
class Loop:
    """Demand = kp e + ki (integral of e) + ff (filtered dr/dt), e = r - mean speed of the motors, r = g v.

    The motors share the demand; each current follows its share with a time constant of its own.
    """

    kp: float
    ki: float
    ff: float
    filter_s: float
    currents_s: tuple[float, ...]
    velocity_gain: float


@dataclass(frozen=True, eq=False)
class Drive:
    """Mechanics in their loop; states: angles, speeds, integral of error, filtered reference, currents."""

    mechanism: Mechanism
    loop: Loop
    at_motor: bool

    @property
    def states(self) -> int:
        return 2 * self.mechanism.size + 2 + len(self.loop.currents_s)

    @property
    def motor_inertia(self) -> float:
        """Of the first motor, on which friction and ripple act."""
        return self.mechanism.motor_inertia

    def read(self) -> FloatArray:
        """Weights of the states (states,) in the angle that the encoder reads."""
        row = np.zeros(self.states)
        row[self.mechanism.motors[0] if self.at_motor else self.mechanism.hub] = 1.0
        return row

    def demand(self) -> tuple[FloatArray, float]:
        """Weights of the states (states,) and of v in the torque that the loop asks for."""
        loop, n, motors = self.loop, self.mechanism.size, list(self.mechanism.motors)
        row = np.zeros(self.states)
        row[[n + i for i in motors]] = -loop.kp / len(motors)
        row[2 * n] = loop.ki
        row[2 * n + 1] = -loop.ff / loop.filter_s
        return row, loop.velocity_gain * (loop.kp + loop.ff / loop.filter_s)

    def state_space(self) -> tuple[FloatArray, FloatArray]:
        """A (states, states) and B (states, 6) of dx/dt = A x + B (v, torques, change of the demand)."""
        body, loop, n, motors = self.mechanism, self.loop, self.mechanism.size, list(self.mechanism.motors)
        a, b = np.zeros((self.states, self.states)), np.zeros((self.states, INPUTS))
        angles, speeds, currents = slice(0, n), slice(n, 2 * n), 2 * n + 2
        a[angles, speeds] = np.eye(n)
        torques = np.zeros((n, INPUTS))
        torques[motors[0], MOTOR_TORQUE] = torques[body.hub, LOAD_TORQUE] = 1.0
        torques[:, STRUCTURE_TORQUE] = body.tip
        one, other, _ = body.mesh
        torques[one, PAIR_TORQUE], torques[other, PAIR_TORQUE] = -1.0, 1.0
        shares = np.zeros((n, len(motors)))
        shares[motors, range(len(motors))] = 1.0
        solved = np.linalg.solve(body.inertia, np.hstack([-body.stiffness, -body.damping, torques, shares]))
        a[speeds, : currents - 2] = solved[:, : 2 * n]
        b[speeds] = solved[:, 2 * n : 2 * n + INPUTS]
        a[speeds, currents:] = solved[:, 2 * n + INPUTS :]
        a[2 * n, [n + i for i in motors]] = -1 / len(motors)
        b[2 * n, REFERENCE] = loop.velocity_gain
        a[2 * n + 1, 2 * n + 1], b[2 * n + 1, REFERENCE] = (
            -1 / loop.filter_s,
            loop.velocity_gain / loop.filter_s,
        )
        row, direct = self.demand()
        for motor, lag in enumerate(loop.currents_s):
            a[currents + motor] += row / (len(motors) * lag)
            a[currents + motor, currents + motor] -= 1 / lag
            b[currents + motor, REFERENCE] = direct / (len(motors) * lag)
            b[currents + motor, DEMAND] = 1 / (len(motors) * lag)
        return a, b

    def step_matrices(self, step_s: float) -> tuple[FloatArray, FloatArray]:
        """exp(A h) (states, states) and its integral times B (states, 6): inputs are held over h."""
        a, b = self.state_space()
        n = self.states
        block = np.zeros((n + INPUTS, n + INPUTS))
        block[:n, :n], block[:n, n:] = a, b
        exponential = linalg.expm(block * step_s)
        return exponential[:n, :n].copy(), exponential[:n, n:].copy()

    def sampled(self, rate_hz: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(A, B, C) over one sample with v held, of the states that the angle knows of."""
        transition, forcing = self.step_matrices(1 / rate_hz)
        used = np.ones(self.states, dtype=bool)
        used[2 * self.mechanism.size] = self.loop.ki != 0
        used[2 * self.mechanism.size + 1] = self.loop.ff != 0
        return transition[np.ix_(used, used)], forcing[used, REFERENCE], self.read()[used]


def draw_loop(rng: np.random.Generator, mechanism: Mechanism, top_hz: float) -> Loop:
    """P or PI, with feed-forward or without, a corner of 0.15 to 0.7 of `top_hz`, currents of 2 to 15 ms."""
    total, motors = mechanism.total_inertia, len(mechanism.motors)
    corner = 2 * np.pi * log_uniform(rng, 0.15, 0.7) * top_hz
    kind = str(rng.choice(["P", "PI", "P+FF", "PI+FF"], p=[0.15, 0.45, 0.1, 0.3]))
    return Loop(
        corner * total,
        corner * corner / log_uniform(rng, 3.0, 12.0) * total if "PI" in kind else 0.0,
        float(rng.uniform(0.3, 0.9)) * total if "FF" in kind else 0.0,
        log_uniform(rng, 0.03, 0.1),
        tuple(log_uniform(rng, 0.002, 0.015) for _ in range(motors)),
        float(rng.uniform(0.33, 1.25)),
    )
