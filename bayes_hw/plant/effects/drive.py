"""Faults of the drive: dry friction, backlash, torque ripple."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayes_hw.plant.effects.effect import Effect, Parameters, Scales, log_uniform
from bayes_hw.plant.integrator import Friction, Wave
from bayes_hw.plant.run import Run

TORQUE_SHARE = 0.1
LARGEST_TORQUES = 8.0
"""Friction, ripple and drag at full speed stay below so many times the gear's torque (root mean square)."""

FRICTION_KINDS = (
    "coulomb_motor",
    "stribeck_motor",
    "lugre_motor",
    "coulomb_load",
    "stribeck_load",
    "lugre_load",
)
FRICTION_SHARES = (0.25, 0.25, 0.15, 0.13, 0.12, 0.10)


@dataclass(frozen=True)
class DryFriction(Effect):
    """Coulomb, Stribeck or LuGre friction at the motor, inside its velocity loop, or at the load.

    Static over Coulomb torque 1.2 to 1.7, Stribeck speed 0.5 to 5 % of the axis' largest, presliding
    stiffness such that the body alone would ring at 8 to 25 Hz on its bristles.
    """

    label: ClassVar[str] = "friction"
    torque: float
    static_ratio: float
    stribeck_speed: float
    bristle_hz: float
    largest = LARGEST_TORQUES / TORQUE_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> DryFriction:
        return cls(
            str(rng.choice(FRICTION_KINDS, p=FRICTION_SHARES)),
            TORQUE_SHARE * scales.torque,
            float(rng.uniform(1.2, 1.7)),
            log_uniform(rng, 0.005, 0.05) * scales.speed,
            float(rng.uniform(8, 25)),
        )

    def act(self, run: Run, strength: float) -> None:
        shape, body = self.detail.split("_")
        inertia = run.drive.motor_inertia if body == "motor" else 1.0
        coulomb = strength * self.torque
        stiffness = inertia * (2 * np.pi * self.bristle_hz) ** 2 if shape == "lugre" else 0.0
        friction = Friction(
            coulomb,
            coulomb if shape == "coulomb" else coulomb * self.static_ratio,
            self.stribeck_speed,
            stiffness,
            0.1 * np.sqrt(stiffness * inertia),
        )
        run.change(**{f"{body}_friction": friction})

    def parameters(self, strength: float) -> Parameters:
        return {
            "kind": self.detail,
            "coulomb_deg_s2": strength * self.torque,
            "static_ratio": self.static_ratio,
        }


@dataclass(frozen=True)
class Backlash(Effect):
    """Play of the output behind the compliance, or a gap in the gear whose flanks meet elastically."""

    label: ClassVar[str] = "backlash"
    half_gap_deg: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Backlash:
        return cls(str(rng.choice(["kinematic", "dynamic"])), 2 * scales.sigma)

    def act(self, run: Run, strength: float) -> None:
        field = "play_half_gap" if self.detail == "kinematic" else "gear_half_gap"
        run.change(**{field: strength * self.half_gap_deg})

    def parameters(self, strength: float) -> Parameters:
        return {"kind": self.detail, "half_gap_deg": strength * self.half_gap_deg}


@dataclass(frozen=True)
class TorqueRipple(Effect):
    """Cogging of the motor, gear mesh or rail unevenness: a torque periodic in the angle.

    The rail is nowhere steeper than the gear is stiff: beyond that an axis at rest has several places to be,
    snaps from one to the next, and no telescope points with it. `gear_stiffness` in 1/s^2.
    """

    label: ClassVar[str] = "torque_ripple"
    torque: float
    period_deg: float
    phase: float
    second: float
    gear_stiffness: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> TorqueRipple:
        return cls(
            str(rng.choice(["cogging_motor", "gear_mesh", "rail_load"], p=[0.4, 0.25, 0.35])),
            TORQUE_SHARE * scales.torque,
            log_uniform(rng, 0.06, 0.6) * scales.travel,
            float(rng.uniform(0, 2 * np.pi)),
            float(rng.choice([0.0, rng.uniform(0.1, 0.4)])),
            scales.torque / scales.twist,
        )

    @property
    def largest(self) -> float:
        largest = LARGEST_TORQUES / TORQUE_SHARE
        if self.detail != "rail_load":
            return largest
        slope = self.torque * 2 * np.pi / self.period_deg * (1 + 2 * self.second)
        return float(min(largest, self.gear_stiffness / slope))

    def act(self, run: Run, strength: float) -> None:
        wave = Wave(strength * self.torque, 2 * np.pi / self.period_deg, self.phase, self.second)
        field = {"cogging_motor": "motor_ripple", "gear_mesh": "mesh_ripple", "rail_load": "load_ripple"}
        run.change(**{field[self.detail]: wave})

    def parameters(self, strength: float) -> Parameters:
        return {
            "kind": self.detail,
            "period_axis_deg": self.period_deg,
            "amplitude_deg_s2": strength * self.torque,
        }
