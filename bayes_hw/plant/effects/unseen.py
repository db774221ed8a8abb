"""Faults off the diagnosis' catalogue that no version of it was changed on.

Mains hum is the exception: its misses showed that a line in time was laid to chaotic motion, mended since.

They measure whether `other` is said of faults that nobody had in mind: keep them out of what constants are
fitted on, and once misses on them have been read, move them to the groups that the diagnosis has met.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.plant.effects.effect import Effect, Parameters, Scales, log_uniform
from bayes_hw.plant.effects.second_group import UNIT_SHARE
from bayes_hw.plant.integrator import EXTERNAL_GAIN, EXTERNAL_LOAD
from bayes_hw.plant.run import Run

DERATING_STREAM, HUNTING_STREAM, BALLAST_STREAM, HUM_STREAM = 141, 142, 143, 144


@dataclass(frozen=True)
class CableWrap(Effect):
    """Beyond an angle on either side the cable wrap pulls back like a spring."""

    begin_deg: float
    stiffness: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CableWrap:
        begin = float(rng.uniform(0.1, 0.8)) * scales.travel
        return cls("cable_wrap", begin, UNIT_SHARE * scales.torque / scales.travel)

    def act(self, run: Run, strength: float) -> None:
        run.change(wrap_begin=self.begin_deg, wrap_stiffness=strength * self.stiffness)

    def parameters(self, strength: float) -> Parameters:
        return {"begin_axis_deg": self.begin_deg, "stiffness_per_s2": strength * self.stiffness}


@dataclass(frozen=True)
class CommandPlay(Effect):
    """Commands follow their source with play, as those of a worn handwheel or a hysteretic converter do
    (Tao and Kokotovic 1996)."""

    half_gap_deg_s: float
    largest = 1.0 / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CommandPlay:  # noqa: ARG003
        return cls("command_play", 0.4 * UNIT_SHARE * scales.limit)

    def act(self, run: Run, strength: float) -> None:
        half_gap = strength * self.half_gap_deg_s
        followed, kept = np.empty_like(run.command), 0.0
        for k, command in enumerate(run.command):
            kept = min(max(kept, command - half_gap), command + half_gap)
            followed[k] = kept
        run.command = followed

    def parameters(self, strength: float) -> Parameters:
        return {"half_gap_deg_s": strength * self.half_gap_deg_s}


@dataclass(frozen=True)
class Derating(Effect):
    """A hot amplifier lowers its speed limits at some instant of every record and keeps them low."""

    largest = 0.9 / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Derating:  # noqa: ARG003
        return cls("derating")

    def act(self, run: Run, strength: float) -> None:
        begin = float(run.rng(DERATING_STREAM).uniform(0.2, 0.7)) * run.duration_s
        left = 1 - min(strength, self.largest) * UNIT_SHARE
        derated = np.clip(run.command, left * run.axis.lower, left * run.axis.upper)
        run.command = np.where(run.time >= begin, derated, run.command)

    def parameters(self, strength: float) -> Parameters:
        return {"share": min(strength, self.largest) * UNIT_SHARE}


@dataclass(frozen=True)
class HuntingGain(Effect):
    """The gain of the drive's reference swings slowly in time: its supply hunts."""

    hz: float
    largest = 0.9 / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> HuntingGain:
        return cls("hunting_gain", log_uniform(rng, 2.0, 20.0) / scales.duration_s)

    def act(self, run: Run, strength: float) -> None:
        phase = float(run.rng(HUNTING_STREAM).uniform(0, 2 * np.pi))
        depth = min(strength, self.largest) * UNIT_SHARE
        run.external[:, EXTERNAL_GAIN] += depth * np.sin(2 * np.pi * self.hz * run.fine_time + phase)

    def parameters(self, strength: float) -> Parameters:
        return {"depth": min(strength, self.largest) * UNIT_SHARE, "hz": self.hz}


@dataclass(frozen=True)
class LostBallast(Effect):
    """Something falls off at some instant of every record: a constant torque on the load from then on."""

    torque: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> LostBallast:
        return cls("lost_ballast", float(rng.choice([-1.0, 1.0])) * scales.torque)

    def act(self, run: Run, strength: float) -> None:
        begin = float(run.rng(BALLAST_STREAM).uniform(0.15, 0.7)) * run.duration_s
        run.external[:, EXTERNAL_LOAD] += strength * self.torque * (run.fine_time >= begin)

    def parameters(self, strength: float) -> Parameters:
        return {"torque_deg_s2": strength * self.torque}


@dataclass(frozen=True)
class MainsHum(Effect):
    """A sine of constant frequency in the encoder's reading, aliased from the mains."""

    hz: float
    amplitude: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> MainsHum:
        return cls("mains_hum", float(rng.uniform(0.02, 0.48)) * scales.sample_rate_hz, scales.sigma)

    def act(self, run: Run, strength: float) -> None:
        phase = float(run.rng(HUM_STREAM).uniform(0, 2 * np.pi))
        run.drift = run.drift + strength * self.amplitude * np.sin(2 * np.pi * self.hz * run.time + phase)

    def parameters(self, strength: float) -> Parameters:
        return {"hz": self.hz, "amplitude_deg": strength * self.amplitude}


@dataclass(frozen=True)
class ReadingLead(Effect):
    """The reading head's carriage bends with the square of the speed."""

    lead_s2_per_deg: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> ReadingLead:
        sign = float(rng.choice([-1.0, 1.0]))
        return cls("reading_lead", sign * scales.sigma / scales.speed**2)

    def act(self, run: Run, strength: float) -> None:
        run.reading_lead = strength * self.lead_s2_per_deg

    def parameters(self, strength: float) -> Parameters:
        return {"lead_s2_per_deg": strength * self.lead_s2_per_deg}


@dataclass(frozen=True)
class SoftLimiter(Effect):
    """The limiter bends before it limits: a share of the command goes through a hyperbolic tangent."""

    limit_deg_s: float
    largest = 1.0 / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> SoftLimiter:  # noqa: ARG003
        return cls("soft_limiter", scales.limit)

    def act(self, run: Run, strength: float) -> None:
        share = min(strength, self.largest) * UNIT_SHARE
        bent = self.limit_deg_s * np.tanh(run.command / self.limit_deg_s)
        run.command = (1 - share) * run.command + share * bent

    def parameters(self, strength: float) -> Parameters:
        return {"share": min(strength, self.largest) * UNIT_SHARE}
