"""More faults off the diagnosis' catalogue: it was measured on them unmet, then changed on their misses.

Keep them out of what constants are fitted on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.plant.effects.drive import LARGEST_TORQUES
from bayes_hw.plant.effects.effect import Effect, Parameters, Scales
from bayes_hw.plant.integrator import (
    EXTERNAL_GAIN,
    EXTERNAL_LOAD,
    EXTERNAL_LOST,
    EXTERNAL_MOTOR,
    EXTERNAL_OIL,
)
from bayes_hw.plant.run import Run

LATE_STREAM, LOST_STREAM, TACHO_STREAM, SKIP_STREAM = 131, 132, 133, 134
UNIT_SHARE = 0.05
"""Of what the fault changes, at strength 1."""


@dataclass(frozen=True)
class BrownOut(Effect):
    """The supply sags for a stretch: of the torque that the velocity loop asks for the amplifier gives less
    (torque is proportional to current, Gawronski 2008, chapter 2)."""

    length: float
    largest = 0.95 / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> BrownOut:  # noqa: ARG003
        return cls("brown_out", float(rng.uniform(0.15, 0.45)))

    def act(self, run: Run, strength: float) -> None:
        begin = float(run.rng(LOST_STREAM).uniform(0.05, 0.95 - self.length)) * run.duration_s
        on = (run.fine_time >= begin) & (run.fine_time < begin + self.length * run.duration_s)
        run.external[:, EXTERNAL_LOST] += min(strength, self.largest) * UNIT_SHARE * on

    def parameters(self, strength: float) -> Parameters:
        return {"share": min(strength, self.largest) * UNIT_SHARE, "length_of_record": self.length}


@dataclass(frozen=True)
class CoarseCommand(Effect):
    """A converter of few bits rounds the command, up or down to its next step (Widrow and Kollar 2008)."""

    step_deg_s: float
    largest = 0.5 / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CoarseCommand:  # noqa: ARG003
        return cls("coarse_command", UNIT_SHARE * scales.limit)

    def act(self, run: Run, strength: float) -> None:
        step = strength * self.step_deg_s
        run.command = step * np.round(run.command / step)

    def parameters(self, strength: float) -> Parameters:
        return {"step_deg_s": strength * self.step_deg_s}


@dataclass(frozen=True)
class CommandDeadBand(Effect):
    """A drive that takes small commands for drift of its input and stands still (Tao and Kokotovic 1996)."""

    width_deg_s: float
    largest = 0.5 / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CommandDeadBand:  # noqa: ARG003
        return cls("command_dead_band", UNIT_SHARE * scales.limit)

    def act(self, run: Run, strength: float) -> None:
        run.command = np.where(np.abs(run.command) < strength * self.width_deg_s, 0.0, run.command)

    def parameters(self, strength: float) -> Parameters:
        return {"half_width_deg_s": strength * self.width_deg_s}


@dataclass(frozen=True)
class Congestion(Effect):
    """Commands come late while the network is busy, in stretches (Hespanha et al. 2007,
    doi 10.1109/JPROC.2006.887288)."""

    late_s: float
    stretch_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Congestion:
        return cls("congestion", 0.02, float(rng.uniform(0.1, 0.25)) * scales.duration_s)

    @property
    def largest(self) -> float:
        return 1.0 / self.late_s

    def act(self, run: Run, strength: float) -> None:
        """Lateness rises to a peak of random height in the middle of every busy stretch and falls again."""
        rng = run.rng(LATE_STREAM)
        t, late = run.time, np.zeros(run.samples)
        middle = float(rng.uniform(0.5, 1.5)) * self.stretch_s
        while middle < run.duration_s:
            height, half = float(rng.uniform(0.5, 1.5)), 0.5 * self.stretch_s
            late += height * np.maximum(1 - np.abs(t - middle) / half, 0.0)
            middle += float(rng.uniform(1.2, 2.5)) * self.stretch_s
        run.late_s = run.late_s + min(strength, self.largest) * self.late_s * late

    def parameters(self, strength: float) -> Parameters:
        return {"late_s": min(strength, self.largest) * self.late_s, "stretch_s": self.stretch_s}


@dataclass(frozen=True)
class DirectionalGain(Effect):
    """An amplifier whose gain is not the same for both directions: its half bridges are unlike."""

    sign: float
    largest = 0.6 / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> DirectionalGain:  # noqa: ARG003
        return cls("directional_gain", float(rng.choice([-1.0, 1.0])))

    def act(self, run: Run, strength: float) -> None:
        run.change(forward_gain=self.sign * min(strength, self.largest) * UNIT_SHARE)

    def parameters(self, strength: float) -> Parameters:
        return {"forward_fraction": self.sign * min(strength, self.largest) * UNIT_SHARE}


@dataclass(frozen=True)
class QuadraticDrag(Effect):
    """The air's drag on a turning dish: a torque on the load as the square of its speed (Rayleigh 1876)."""

    per_deg: float
    largest = LARGEST_TORQUES / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> QuadraticDrag:  # noqa: ARG003
        return cls("quadratic_drag", UNIT_SHARE * scales.torque / scales.speed**2)

    def act(self, run: Run, strength: float) -> None:
        run.change(drag=strength * self.per_deg)

    def parameters(self, strength: float) -> Parameters:
        return {"per_deg": strength * self.per_deg}


@dataclass(frozen=True)
class TachoFault(Effect):
    """The tachometer's scale jumps at some instant of every record and stays: a brush, a bad contact."""

    sign: float
    largest = 0.6 / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> TachoFault:  # noqa: ARG003
        return cls("tacho_fault", float(rng.choice([-1.0, 1.0])))

    def act(self, run: Run, strength: float) -> None:
        begin = float(run.rng(TACHO_STREAM).uniform(0.25, 0.75)) * run.duration_s
        change = self.sign * min(strength, self.largest) * UNIT_SHARE
        run.external[:, EXTERNAL_GAIN] += change * (run.fine_time >= begin)

    def parameters(self, strength: float) -> Parameters:
        return {"fraction": self.sign * min(strength, self.largest) * UNIT_SHARE}


@dataclass(frozen=True)
class ToothSkip(Effect):
    """A gear skips once a record: the load rests at another angle to the motor from then on."""

    jump_deg: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> ToothSkip:  # noqa: ARG003
        return cls("tooth_skip", 2 * scales.sigma)

    def act(self, run: Run, strength: float) -> None:
        """A twist of another zero is a pair of torques, stiffness times the jump."""
        rng = run.rng(SKIP_STREAM)
        begin, sign = float(rng.uniform(0.2, 0.8)) * run.duration_s, float(rng.choice([-1.0, 1.0]))
        torque = run.drive.stiffness * sign * strength * self.jump_deg * (run.fine_time >= begin)
        run.external[:, EXTERNAL_LOAD] += torque
        run.external[:, EXTERNAL_MOTOR] -= torque

    def parameters(self, strength: float) -> Parameters:
        return {"jump_deg": strength * self.jump_deg}


@dataclass(frozen=True)
class WarmingOil(Effect):
    """Viscous drag of the load that falls as the oil warms up (viscosity falls exponentially with
    temperature, Reynolds 1886)."""

    drag_hz: float
    tau_s: float
    largest = LARGEST_TORQUES / UNIT_SHARE

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> WarmingOil:
        tau = float(rng.uniform(0.15, 0.5)) * scales.duration_s
        return cls("warming_oil", UNIT_SHARE * scales.torque / scales.speed, tau)

    def act(self, run: Run, strength: float) -> None:
        run.external[:, EXTERNAL_OIL] += strength * self.drag_hz * np.exp(-run.fine_time / self.tau_s)

    def parameters(self, strength: float) -> Parameters:
        return {"cold_per_s": strength * self.drag_hz, "tau_s": self.tau_s}
