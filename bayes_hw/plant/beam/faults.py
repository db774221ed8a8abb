"""Faults of these axes: those of the home plant's, and what a controller and a warm motor add."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayes_hw.plant.beam.simulation import BeamRun
from bayes_hw.plant.effects import CATALOGUE as HOME_CATALOGUE
from bayes_hw.plant.effects.command import RateLimit
from bayes_hw.plant.effects.effect import Effect, Parameters, Scales, log_uniform, with_own
from bayes_hw.plant.effects.linear import (
    LARGEST_MASS_RATIO,
    MASS_RATIO,
    frequency_clear_of_modes,
)
from bayes_hw.plant.effects.off_catalogue import (
    BoucWen,
    CrossAxis,
    CurrentLimit,
    CurvedCommand,
    PeriodicDisturbance,
    StuckBrake,
    WheelSlip,
)
from bayes_hw.plant.effects.second_group import BrownOut, DirectionalGain, QuadraticDrag
from bayes_hw.plant.effects.sensor import (
    Quantization,
)
from bayes_hw.plant.effects.unseen import Derating, HuntingGain
from bayes_hw.plant.integrator import EXTERNAL_LOST


@dataclass(frozen=True)
class ControllerRamp(RateLimit):
    """The ramp of the home plant, or one that a controller moves once a sample."""

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> RateLimit:
        detail = str(rng.choice(["ramp_after_limiter", "ramp_in_samples"]))
        return cls(detail, 3 * scales.limit)

    def act(self, run: BeamRun, strength: float) -> None:  # type: ignore[override]
        if self.detail == "ramp_in_samples":
            run.sampled_ramp = self.rate_deg_s2 / strength / run.axis.sample_rate_hz
        else:
            super().act(run, strength)


@dataclass(frozen=True)
class FurtherMode(Effect):
    """One more body on a lightly damped spring, at the hub or at the first motor."""

    label: ClassVar[str] = "unmodelled_mode"
    hz: float
    damping_ratio: float
    largest = LARGEST_MASS_RATIO / MASS_RATIO

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> FurtherMode:
        hz = frequency_clear_of_modes(rng, scales, 0.5, 0.35)
        return cls(str(rng.choice(["hub", "motor"], p=[0.75, 0.25])), hz, log_uniform(rng, 0.004, 0.03))

    def act(self, run: BeamRun, strength: float) -> None:
        body = run.drive.mechanism
        host = body.hub if self.detail == "hub" else body.motors[0]
        inertia = MASS_RATIO * strength * float(body.inertia[host, host])
        run.drive = replace(
            run.drive, mechanism=body.with_appendage(host, inertia, self.hz, self.damping_ratio)
        )

    def parameters(self, strength: float) -> Parameters:
        return {"kind": self.detail, "hz": self.hz, "mass_ratio": MASS_RATIO * strength}


@dataclass(frozen=True)
class Rounding(Quantization):
    """The reading is rounded to a step, its noise within it or added behind it."""

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Quantization:
        return cls(str(rng.choice(["noise_before", "noise_after"])), 3 * scales.sigma)

    def act(self, run: BeamRun, strength: float) -> None:  # type: ignore[override]
        if self.detail == "noise_after":
            run.early_step = strength * self.step_deg
        else:
            super().act(run, strength)


@dataclass(frozen=True)
class WarmMotor(Effect):
    """The motor's torque falls to a share as its windings warm from the start of every record."""

    tau_s: float
    largest = 15.0

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> WarmMotor:
        return cls("warm_motor", float(rng.uniform(0.2, 0.6)) * scales.duration_s)

    def act(self, run: BeamRun, strength: float) -> None:
        lost = min(0.06 * strength, 0.9)
        run.external[:, EXTERNAL_LOST] += lost * (1 - np.exp(-run.fine_time / self.tau_s))

    def parameters(self, strength: float) -> Parameters:
        return {"share": min(0.06 * strength, 0.9), "tau_s": self.tau_s}


CATALOGUE = with_own(HOME_CATALOGUE, (ControllerRamp, FurtherMode, Rounding))

UNNAMED: tuple[type[Effect], ...] = (
    BoucWen,
    BrownOut,
    CrossAxis,
    CurrentLimit,
    CurvedCommand,
    Derating,
    DirectionalGain,
    HuntingGain,
    PeriodicDisturbance,
    QuadraticDrag,
    StuckBrake,
    WarmMotor,
    WheelSlip,
)
"""Faults whose label is `other`."""
