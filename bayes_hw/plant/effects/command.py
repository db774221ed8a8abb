"""Faults between the command and the drive: ramp, moving limits, bias, warming gain."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayes_hw.plant.effects.effect import Effect, Parameters, Scales, log_uniform
from bayes_hw.plant.integrator import EXTERNAL_BIAS, EXTERNAL_GAIN, Wave
from bayes_hw.plant.run import RecordRun

LARGEST_DEPTH = 0.6
"""Of the limits: no drive loses more of its speed by position."""


@dataclass(frozen=True)
class RateLimit(Effect):
    """dv/dt limited to limit / strength, behind the limiter or before it."""

    label: ClassVar[str] = "rate_limit"
    rate_deg_s2: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> RateLimit:
        detail = str(rng.choice(["ramp_after_limiter", "ramp_before_limiter"], p=[0.75, 0.25]))
        return cls(detail, 3 * scales.limit)

    def act(self, run: RecordRun, strength: float) -> None:
        first = 1.0 if self.detail == "ramp_before_limiter" else 0.0
        run.change(rate_limit=self.rate_deg_s2 / strength, rate_limit_first=first)

    def parameters(self, strength: float) -> Parameters:
        return {"kind": self.detail, "rate_deg_s2": self.rate_deg_s2 / strength}


@dataclass(frozen=True)
class SaturationDrift(Effect):
    """Limits times 1 + depth sin(2 pi q / period + phase), or times 1 + slope q."""

    label: ClassVar[str] = "saturation_drift"
    period_deg: float
    phase: float
    slope_sign: float
    travel: float
    largest = LARGEST_DEPTH / 0.1

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> SaturationDrift:
        return cls(
            str(rng.choice(["periodic", "slope"], p=[0.75, 0.25])),
            log_uniform(rng, 0.7, 6.0) * scales.travel,
            float(rng.uniform(0, 2 * np.pi)),
            float(rng.choice([-1.0, 1.0])),
            scales.travel,
        )

    def act(self, run: RecordRun, strength: float) -> None:
        if self.detail == "periodic":
            run.change(limit_wave=Wave(0.1 * strength, 2 * np.pi / self.period_deg, self.phase))
        else:
            run.change(limit_slope=0.1 * strength * self.slope_sign / self.travel)

    def parameters(self, strength: float) -> Parameters:
        if self.detail == "periodic":
            return {"kind": self.detail, "depth": 0.1 * strength, "period_axis_deg": self.period_deg}
        return {"kind": self.detail, "per_deg": 0.1 * strength * self.slope_sign / self.travel}


@dataclass(frozen=True)
class CommandBias(Effect):
    """A constant added to the command behind the limiter."""

    label: ClassVar[str] = "command_bias"
    bias_deg_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CommandBias:
        return cls("constant", float(rng.choice([-1.0, 1.0])) * 0.002 * scales.limit)

    def act(self, run: RecordRun, strength: float) -> None:
        run.external[:, EXTERNAL_BIAS] += strength * self.bias_deg_s

    def parameters(self, strength: float) -> Parameters:
        return {"deg_s": strength * self.bias_deg_s}


@dataclass(frozen=True)
class GainDrift(Effect):
    """Gain 1 + a (1 - exp(-t / tau)) as a drive warms up from the start of every record."""

    label: ClassVar[str] = "gain_drift"
    fraction: float
    tau_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> GainDrift:
        fraction = 0.02 * float(rng.choice([-1.0, 1.0], p=[0.7, 0.3]))
        return cls("warm_up", fraction, float(rng.uniform(0.2, 0.7)) * scales.duration_s)

    def act(self, run: RecordRun, strength: float) -> None:
        fraction = max(strength * self.fraction, -0.7)
        run.external[:, EXTERNAL_GAIN] += fraction * (1 - np.exp(-run.fine_time / self.tau_s))

    def parameters(self, strength: float) -> Parameters:
        return {"fraction": max(strength * self.fraction, -0.7), "tau_s": self.tau_s}
