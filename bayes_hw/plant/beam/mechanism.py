"""Mechanics of finite elements: torsional shaft and bending dish, reduced to their lowest modes.

Angles are those of the axis in deg, torques in deg/s^2 of hub and dish together; the dish is a
cantilever of Hermite elements whose root turns with the hub, so that its rigid turning is exact (Craig and
Bampton 1968, doi 10.2514/3.4741, for the reduction).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.effects.effect import log_uniform

SHAFT_ELEMENTS, DISH_ELEMENTS = 3, 4
LOAD_INERTIA = 1.0
SMALLEST_DAMPING, LARGEST_DAMPING = 0.006, 0.04
BEARING_SHARE = 0.05


@dataclass(frozen=True, eq=False)
class Mechanism:
    """M q'' + D q' + K q = torques: inertia, damping and stiffness (n, n).

    `motors` are the coordinates of the motors; `hub` that of the load; `mesh` the two of the first gear stage
    of the first motor and its stiffness; `tip` (n,) how the dish's tip turns with the coordinates.
    """

    inertia: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    motors: tuple[int, ...]
    hub: int
    mesh: tuple[int, int, float]
    tip: FloatArray

    @property
    def size(self) -> int:
        return len(self.inertia)

    @property
    def motor_inertia(self) -> float:
        """Of the first motor."""
        return float(self.inertia[self.motors[0], self.motors[0]])

    @property
    def total_inertia(self) -> float:
        """Of everything, turned as one."""
        rigid = np.zeros(self.size)
        rigid[: self.hub + 1] = 1.0
        return float(rigid @ self.inertia @ rigid)

    def with_appendage(self, host: int, inertia: float, hz: float, damping_ratio: float) -> Mechanism:
        """One more body on a spring at coordinate `host`, `hz` with its host held; its angle is relative."""
        n, omega = self.size, 2 * np.pi * hz
        grown = [np.pad(matrix, (0, 1)) for matrix in (self.inertia, self.damping, self.stiffness)]
        for i, j in ((host, host), (host, n), (n, host), (n, n)):
            grown[0][i, j] += inertia
        grown[1][n, n] = 2 * damping_ratio * omega * inertia
        grown[2][n, n] = omega**2 * inertia
        mass, loss, spring = grown
        return replace(self, inertia=mass, damping=loss, stiffness=spring, tip=np.append(self.tip, 0.0))

    def frequencies_hz(self) -> FloatArray:
        """Of the undamped mechanism with free motors (n,), in ascending order; the first is zero."""
        squared = linalg.eigh(self.stiffness, self.inertia, eigvals_only=True)
        return np.sqrt(np.maximum(squared, 0.0)) / (2 * np.pi)


def draw_mechanism(rng: np.random.Generator, top_hz: float) -> Mechanism:
    """One motor or two with one or two gear stages, a shaft, a hub, a dish; `top_hz` scales springs."""
    motors, stages = int(rng.choice([1, 2], p=[0.6, 0.4])), int(rng.choice([1, 2], p=[0.6, 0.4]))
    share = float(rng.uniform(0.2, 0.55))
    stiffness, inertia = _drives(rng, top_hz, motors, stages)
    bull = len(stiffness) - 1
    hub = bull + 1
    size = hub + SHAFT_ELEMENTS + 2 * DISH_ELEMENTS
    k, m = np.zeros((size, size)), np.zeros((size, size))
    k[:hub, :hub], m[:hub, :hub] = stiffness, inertia
    inner = list(range(hub + 1, hub + SHAFT_ELEMENTS))
    _add_shaft(
        k, m, [bull, *inner, hub],
        LOAD_INERTIA * (2 * np.pi * log_uniform(rng, 0.25, 0.9) * top_hz) ** 2,
        log_uniform(rng, 0.02, 0.15),
    )  # fmt: skip
    m[hub, hub] += LOAD_INERTIA * (1 - share)
    dish = [hub, *range(hub + SHAFT_ELEMENTS, size)]
    bending, moved = _dish(
        LOAD_INERTIA * share, float(rng.uniform(0.0, 0.6)), log_uniform(rng, 0.25, 1.1) * top_hz
    )
    k[np.ix_(dish, dish)] += bending
    m[np.ix_(dish, dish)] += moved
    tip = np.zeros(size)
    tip[-2] = 1.0
    keep = int(rng.integers(1, 4))
    inertia, stiffness, tip = _reduced(m, k, tip, hub + 1, keep)
    first = stages > 1
    mesh = (0, motors if first else bull, -float(k[0, motors if first else bull]))
    found = Mechanism(inertia, np.zeros_like(inertia), stiffness, tuple(range(motors)), hub, mesh, tip)
    return replace(found, damping=_modal_damping(rng, found))


def _drives(
    rng: np.random.Generator, top_hz: float, motors: int, stages: int
) -> tuple[FloatArray, FloatArray]:
    """Stiffness and inertia of motors, intermediate wheels and, last, the bull gear."""
    size = motors * stages + 1
    k, m = np.zeros((size, size)), np.zeros((size, size))
    inertia, wheel = log_uniform(rng, 0.2, 2.0) / motors, log_uniform(rng, 0.05, 0.3) / motors
    m[-1, -1] = log_uniform(rng, 0.05, 0.3)
    spring = (2 * np.pi * log_uniform(rng, 0.5, 1.5) * top_hz) ** 2 / motors
    for motor in range(motors):
        chain = [motor, *([motors + motor] if stages > 1 else []), size - 1]
        unlike = float(rng.uniform(0.85, 1.15))
        m[motor, motor] = inertia * unlike
        for one, other in pairwise(chain):
            m[other, other] += wheel if other != size - 1 else 0.0
            ends = np.ix_([one, other], [one, other])
            k[ends] += spring * float(rng.uniform(0.8, 1.25)) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return k, m


def _add_shaft(k: FloatArray, m: FloatArray, nodes: list[int], stiffness: float, inertia: float) -> None:
    """Linear elements in torsion of this stiffness and inertia altogether."""
    count = len(nodes) - 1
    for ends in pairwise(nodes):
        at = np.ix_(ends, ends)
        k[at] += count * stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
        m[at] += inertia / count / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])


def _dish(inertia: float, tip_share: float, hz: float) -> tuple[FloatArray, FloatArray]:
    """Stiffness and inertia of a unit cantilever: its root's slope, then (deflection, slope) by node.

    `inertia` is about the root, a share of it a point mass at the tip; `hz` its first frequency, root held.
    """
    h = 1 / DISH_ELEMENTS
    bend = np.array(
        [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h * h, -6 * h, 2 * h * h],
         [-12, -6 * h, 12, -6 * h], [6 * h, 2 * h * h, -6 * h, 4 * h * h]]
    )  # fmt: skip
    mass = np.array(
        [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h * h, 13 * h, -3 * h * h],
         [54, 13 * h, 156, -22 * h], [-13 * h, -3 * h * h, -22 * h, 4 * h * h]]
    )  # fmt: skip
    size = 2 * DISH_ELEMENTS + 2
    k, m = np.zeros((size, size)), np.zeros((size, size))
    for first in range(0, size - 2, 2):
        at = slice(first, first + 4)
        k[at, at] += bend
        m[at, at] += 3 * inertia * (1 - tip_share) * h / 420 * mass
    m[-2, -2] += inertia * tip_share
    k, m = k[1:, 1:], m[1:, 1:]
    first_squared = float(linalg.eigh(k[1:, 1:], m[1:, 1:], eigvals_only=True)[0])
    return k * (2 * np.pi * hz) ** 2 / first_squared, m


def _reduced(
    m: FloatArray, k: FloatArray, tip: FloatArray, kept: int, modes: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Inertia, stiffness and tip with the first `kept` coordinates and the lowest modes of the others."""
    inner = slice(kept, None)
    static = -np.linalg.solve(k[inner, inner], k[inner, :kept])
    shapes = linalg.eigh(k[inner, inner], m[inner, inner])[1][:, :modes]
    basis = np.block([[np.eye(kept), np.zeros((kept, modes))], [static, shapes]])
    return basis.T @ m @ basis, basis.T @ k @ basis, tip @ basis


def _modal_damping(rng: np.random.Generator, mechanism: Mechanism) -> FloatArray:
    """Light damping of every mode of the free mechanism, and bearings at the motors."""
    squared, shapes = linalg.eigh(mechanism.stiffness, mechanism.inertia)
    omega = np.sqrt(np.maximum(squared, 0.0))
    omega[0] = 0.0
    ratios = np.exp(rng.uniform(np.log(SMALLEST_DAMPING), np.log(LARGEST_DAMPING), len(omega)))
    left = mechanism.inertia @ shapes
    damping = left @ np.diag(2 * ratios * omega) @ left.T
    for motor in mechanism.motors:
        damping[motor, motor] += BEARING_SHARE * mechanism.inertia[motor, motor]
    return np.asarray(damping)
