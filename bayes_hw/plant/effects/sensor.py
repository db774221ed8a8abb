"""Faults of the encoder: rounding, eccentricity, drift, timing, unequal gain, glitches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayes_hw.plant.effects.effect import Effect, Parameters, Scales, log_uniform
from bayes_hw.plant.integrator import Wave
from bayes_hw.plant.run import RecordRun

DRIFT_STREAM, TIMING_STREAM, OUTLIER_STREAM = 111, 112, 113
LARGEST_HELD_SHARE = 0.6
LARGEST_JITTER = 0.45
UNIT_SIZE = 0.05
"""Share of samples held, or standard deviation of their instants in samples, at strength 1."""


@dataclass(frozen=True)
class Quantization(Effect):
    """The reading is rounded to a step."""

    label: ClassVar[str] = "encoder_quantization"
    step_deg: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Quantization:  # noqa: ARG003
        return cls("rounding", 3 * scales.sigma)

    def act(self, run: RecordRun, strength: float) -> None:
        run.quantization_step = strength * self.step_deg

    def parameters(self, strength: float) -> Parameters:
        return {"step_deg": strength * self.step_deg}


@dataclass(frozen=True)
class Eccentricity(Effect):
    """A reading error periodic in the angle; a disc off its axis, with second harmonic when oval."""

    label: ClassVar[str] = "encoder_eccentricity"
    amplitude_deg: float
    period_deg: float
    phase: float
    second: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Eccentricity:
        oval = rng.random() < 0.25
        return cls(
            "oval" if oval else "eccentric",
            2 * scales.sigma,
            log_uniform(rng, 0.4, 3.0) * scales.travel,
            float(rng.uniform(0, 2 * np.pi)),
            float(rng.uniform(0.2, 0.6)) if oval else 0.0,
        )

    def act(self, run: RecordRun, strength: float) -> None:
        run.eccentricity = Wave(
            strength * self.amplitude_deg, 2 * np.pi / self.period_deg, self.phase, self.second
        )

    def parameters(self, strength: float) -> Parameters:
        return {
            "kind": self.detail,
            "period_deg": self.period_deg,
            "amplitude_deg": strength * self.amplitude_deg,
        }


@dataclass(frozen=True)
class SensorDrift(Effect):
    """A ramp, a thermal settling or a random walk of the reading."""

    label: ClassVar[str] = "sensor_drift"
    total_deg: float
    tau_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> SensorDrift:
        return cls(
            str(rng.choice(["linear", "thermal", "random_walk"], p=[0.4, 0.3, 0.3])),
            5 * scales.sigma * float(rng.choice([-1.0, 1.0])),
            float(rng.uniform(0.1, 0.5)) * scales.duration_s,
        )

    def act(self, run: RecordRun, strength: float) -> None:
        if self.detail == "linear":
            shape = run.time / run.duration_s
        elif self.detail == "thermal":
            shape = 1 - np.exp(-run.time / self.tau_s)
        else:
            shape = np.cumsum(run.rng(DRIFT_STREAM).standard_normal(run.samples)) / np.sqrt(run.samples)
            shape -= shape[0]
        run.drift = run.drift + strength * self.total_deg * shape

    def parameters(self, strength: float) -> Parameters:
        settling: Parameters = {"tau_s": self.tau_s} if self.detail == "thermal" else {}
        return {"kind": self.detail, "total_deg": strength * self.total_deg, **settling}


@dataclass(frozen=True)
class TimingJitter(Effect):
    """Samples off their instants, or held: the angle, or the whole reading with its noise, is repeated."""

    label: ClassVar[str] = "timing_jitter"
    sample_rate_hz: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> TimingJitter:
        kinds = ["held_samples", "held_readings", "jitter"]
        return cls(str(rng.choice(kinds, p=[0.45, 0.15, 0.4])), scales.sample_rate_hz)

    @property
    def largest(self) -> float:
        return (LARGEST_JITTER if self.detail == "jitter" else LARGEST_HELD_SHARE) / UNIT_SIZE

    def _size(self, strength: float) -> float:
        return UNIT_SIZE * min(strength, self.largest)

    def act(self, run: RecordRun, strength: float) -> None:
        rng = run.rng(TIMING_STREAM)
        size = self._size(strength)
        if self.detail == "jitter":
            offset = np.clip(rng.standard_normal(run.samples), -3, 3)
            run.sampling_offset_s = size * offset / self.sample_rate_hz
        elif self.detail == "held_samples":
            run.held = rng.random(run.samples) < size
        else:
            run.repeated = rng.random(run.samples) < size

    def parameters(self, strength: float) -> Parameters:
        name = "sd_samples" if self.detail == "jitter" else "share"
        return {"kind": self.detail, name: self._size(strength)}


@dataclass(frozen=True)
class GainAsymmetry(Effect):
    """Output gain above zero over that below it."""

    label: ClassVar[str] = "gain_asymmetry"
    sign: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> GainAsymmetry:  # noqa: ARG003
        return cls("ratio", float(rng.choice([-1.0, 1.0])))

    def _ratio(self, strength: float) -> float:
        return float(np.exp(0.01 * self.sign * min(strength, 60.0)))

    def act(self, run: RecordRun, strength: float) -> None:
        run.gain_above = self._ratio(strength)

    def parameters(self, strength: float) -> Parameters:
        return {"ratio": self._ratio(strength)}


@dataclass(frozen=True)
class Outliers(Effect):
    """Isolated glitches of the reading: of random size, or of a flipped bit."""

    label: ClassVar[str] = "outliers"
    rate: float
    size_deg: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Outliers:
        return cls(
            str(rng.choice(["random", "bit_flip"], p=[0.7, 0.3])),
            log_uniform(rng, 0.003, 0.02),
            10 * scales.sigma,
        )

    def act(self, run: RecordRun, strength: float) -> None:
        rng = run.rng(OUTLIER_STREAM)
        hit = rng.random(run.samples) < self.rate
        size = rng.standard_normal(run.samples)
        if self.detail == "bit_flip":
            size = np.sign(size)
        run.outliers = run.outliers + strength * self.size_deg * np.where(hit, size, 0.0)

    def parameters(self, strength: float) -> Parameters:
        return {"kind": self.detail, "rate": self.rate, "size_deg": strength * self.size_deg}
