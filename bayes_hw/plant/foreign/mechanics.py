"""Faults of the catalogue in a MuJoCo axis' drive train: friction, play, ripple, a stiffening spring, a mode.

Effects are drawn from the sizes of the axis as those of the home plant are; torques are N m on the axis.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.effects.drive import LARGEST_TORQUES, TORQUE_SHARE
from bayes_hw.plant.effects.effect import Effect, Parameters, Scales, log_uniform
from bayes_hw.plant.effects.linear import MASS_RATIO, frequency_clear_of_modes
from bayes_hw.plant.foreign.simulation import ForeignRun

DEGREE = np.pi / 180
LARGEST_MASS_RATIO = 0.35


class ForeignEffect(Effect):
    """A fault of the mechanism."""

    @abstractmethod
    def act(self, run: ForeignRun, strength: float) -> None:
        """Change the mechanism or its loop."""


@dataclass(frozen=True)
class Friction(ForeignEffect):
    """MuJoCo's dry friction of a joint, or a Stribeck curve over the speed, at motor or load."""

    label: ClassVar[str] = "friction"
    torque: float
    static_excess: float
    stribeck_speed: float
    largest = LARGEST_TORQUES / TORQUE_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Friction:
        kinds = ["coulomb_motor", "coulomb_load", "stribeck_motor", "stribeck_load"]
        return cls(
            str(rng.choice(kinds, p=[0.4, 0.3, 0.2, 0.1])),
            TORQUE_SHARE * scales.torque * DEGREE,
            float(rng.uniform(0.2, 0.7)),
            log_uniform(rng, 0.02, 0.08) * scales.speed * DEGREE,
        )

    def act(self, run: ForeignRun, strength: float) -> None:
        shape, place = self.detail.split("_")
        body = run.train.motor if place == "motor" else run.train.load
        run.dry_friction[body] = strength * self.torque
        if shape == "stribeck":
            excess, slow = strength * self.torque * self.static_excess, self.stribeck_speed

            def stribeck(k: int, q: Any, speed: Any, torques: Any) -> None:  # noqa: ARG001
                x = float(speed[body]) / slow
                torques[body] -= excess * math.tanh(5 * x) * math.exp(-x * x)

            run.torques.append(stribeck)

    def parameters(self, strength: float) -> Parameters:
        return {"kind": self.detail, "coulomb_n_m": strength * self.torque}


@dataclass(frozen=True)
class Backlash(ForeignEffect):
    """A dead band of the gear's spring, or play between the axis and the disc that is read."""

    label: ClassVar[str] = "backlash"
    half_gap_deg: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Backlash:
        return cls(str(rng.choice(["dynamic", "kinematic"], p=[0.6, 0.4])), 2 * scales.sigma)

    def act(self, run: ForeignRun, strength: float) -> None:
        half_gap = strength * self.half_gap_deg
        geared = run.train.motor != run.train.load
        if self.detail == "dynamic" and geared:
            run.gaps[run.train.gear] = half_gap * DEGREE
        else:
            run.encoder = lambda w: _play(w, half_gap)

    def parameters(self, strength: float) -> Parameters:
        return {"kind": self.detail, "half_gap_deg": strength * self.half_gap_deg}


def _play(w: FloatArray, half_gap: float) -> FloatArray:
    found, out = np.empty_like(w), 0.0
    for k, value in enumerate(w.tolist()):
        out = min(max(out, value - half_gap), value + half_gap)
        found[k] = out
    return found


@dataclass(frozen=True)
class Ripple(ForeignEffect):
    """A torque periodic in the angle of motor or load, nowhere steeper than `steepest` (N m/rad)."""

    label: ClassVar[str] = "torque_ripple"
    torque: float
    period_deg: float
    phase: float
    second: float
    steepest: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Ripple:
        return cls(
            str(rng.choice(["cogging", "rail"], p=[0.6, 0.4])),
            TORQUE_SHARE * scales.torque * DEGREE,
            log_uniform(rng, 0.06, 0.6) * scales.travel,
            float(rng.uniform(0, 2 * np.pi)),
            float(rng.choice([0.0, rng.uniform(0.1, 0.4)])),
            scales.torque / scales.twist,
        )

    @property
    def largest(self) -> float:
        slope = self.torque * 2 * np.pi / (self.period_deg * DEGREE) * (1 + 2 * self.second)
        return float(min(LARGEST_TORQUES / TORQUE_SHARE, self.steepest / slope))

    def act(self, run: ForeignRun, strength: float) -> None:
        body = run.train.motor if self.detail == "cogging" else run.train.load
        size, wavenumber = strength * self.torque, 2 * np.pi / (self.period_deg * DEGREE)
        phase, second = self.phase, self.second
        rest = (1 + second) * math.sin(phase)

        def wave(k: int, q: Any, speed: Any, torques: Any) -> None:  # noqa: ARG001
            x = wavenumber * float(q[body])
            torques[body] += size * (math.sin(x + phase) + second * math.sin(2 * x + phase) - rest)

        run.torques.append(wave)

    def parameters(self, strength: float) -> Parameters:
        return {
            "kind": self.detail,
            "period_deg": self.period_deg,
            "amplitude_n_m": strength * self.torque,
        }


@dataclass(frozen=True)
class CubicSpring(ForeignEffect):
    """The gear's torque k D (1 + b D^2), or k D / (1 + |b| D^2) where it softens."""

    label: ClassVar[str] = "cubic_stiffness"
    twist: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CubicSpring:
        return cls(str(rng.choice(["stiffening", "softening"], p=[0.7, 0.3])), scales.twist * DEGREE)

    @property
    def largest(self) -> float:
        return super().largest if self.detail == "stiffening" else 2.0

    def act(self, run: ForeignRun, strength: float) -> None:
        spring = run.train.springs[run.train.gear]
        one, other, stiffness = spring.one, spring.other, spring.stiffness
        b = 0.03 * strength / self.twist**2
        softens = self.detail == "softening"

        def extra(k: int, q: Any, speed: Any, torques: Any) -> None:  # noqa: ARG001
            d = float(q[one] - q[other])
            more = -b * d * d / (1 + b * d * d) if softens else b * d * d
            torques[one] -= stiffness * d * more
            torques[other] += stiffness * d * more

        run.torques.append(extra)

    def parameters(self, strength: float) -> Parameters:
        return {"kind": self.detail, "per_deg2": 0.03 * strength / (self.twist / DEGREE) ** 2}


@dataclass(frozen=True)
class FurtherMode(ForeignEffect):
    """One more body on a lightly damped spring, at the load or at the motor."""

    label: ClassVar[str] = "unmodelled_mode"
    hz: float
    damping_ratio: float
    largest = LARGEST_MASS_RATIO / MASS_RATIO

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> FurtherMode:
        hz = frequency_clear_of_modes(rng, scales, 0.5, 0.35)
        return cls(str(rng.choice(["load", "motor"], p=[0.8, 0.2])), hz, log_uniform(rng, 0.004, 0.03))

    def act(self, run: ForeignRun, strength: float) -> None:
        host = run.train.load if self.detail == "load" else run.train.motor
        inertia = MASS_RATIO * strength * run.train.inertias[host]
        run.train = run.train.with_appendage(host, inertia, self.hz, self.damping_ratio)

    def parameters(self, strength: float) -> Parameters:
        return {"kind": self.detail, "hz": self.hz, "mass_ratio": MASS_RATIO * strength}
