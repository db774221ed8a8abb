"""Faults that no entry of the diagnosis' catalogue describes: it is to say `other`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.plant.effects.effect import Effect, Parameters, Scales, log_uniform
from bayes_hw.plant.integrator import EXTERNAL_BRAKE, EXTERNAL_LOAD, EXTERNAL_STRUCTURE, Wave
from bayes_hw.plant.run import Run

CROSS_STREAM, DROP_STREAM, BRAKE_STREAM = 121, 122, 123


@dataclass(frozen=True)
class PeriodicDisturbance(Effect):
    """A torque of constant frequency in time at the load: a cryocooler, a pump, another drive."""

    torque: float
    hz: float
    phase: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> PeriodicDisturbance:
        hz = log_uniform(rng, 0.1, min(6.0, 0.35 * scales.sample_rate_hz))
        return cls("periodic_disturbance", 0.05 * scales.torque, hz, float(rng.uniform(0, 2 * np.pi)))

    def act(self, run: Run, strength: float) -> None:
        wave = np.sin(2 * np.pi * self.hz * run.fine_time + self.phase)
        run.external[:, EXTERNAL_LOAD] += strength * self.torque * wave

    def parameters(self, strength: float) -> Parameters:
        return {"hz": self.hz, "amplitude_deg_s2": strength * self.torque}


@dataclass(frozen=True)
class WheelSlip(Effect):
    """Wheels slip on the rail when the gear's torque exceeds what their grip carries."""

    torque: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> WheelSlip:  # noqa: ARG003
        return cls("wheel_slip", 2 * scales.torque)

    def act(self, run: Run, strength: float) -> None:
        run.change(slip_torque=self.torque / strength)

    def parameters(self, strength: float) -> Parameters:
        return {"grip_deg_s2": self.torque / strength}


@dataclass(frozen=True)
class CrossAxis(Effect):
    """The other axis moves: pulses of reaction torque as it accelerates and brakes."""

    torque: float
    pulse_s: float
    every_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CrossAxis:
        return cls(
            "cross_axis",
            0.2 * scales.torque,
            float(rng.uniform(0.3, 2.0)),
            float(rng.uniform(0.05, 0.2)) * scales.duration_s,
        )

    def act(self, run: Run, strength: float) -> None:
        rng = run.rng(CROSS_STREAM)
        t, torque = run.fine_time, np.zeros(run.steps)
        start = float(rng.uniform(0.2, 1.0)) * self.every_s
        while start < run.duration_s:
            sign, size = float(rng.choice([-1.0, 1.0])), float(rng.uniform(0.5, 1.5))
            cruise = float(rng.uniform(1, 4)) * self.pulse_s
            for begin, direction in ((start, sign), (start + self.pulse_s + cruise, -sign)):
                torque += direction * size * ((t >= begin) & (t < begin + self.pulse_s))
            start += float(rng.uniform(0.5, 1.5)) * self.every_s
        run.external[:, EXTERNAL_STRUCTURE] += strength * self.torque * torque

    def parameters(self, strength: float) -> Parameters:
        return {"torque_deg_s2": strength * self.torque, "pulse_s": self.pulse_s}


@dataclass(frozen=True)
class CurrentLimit(Effect):
    """The amplifier gives no more than a largest current, while the loop's integral winds up."""

    torque: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CurrentLimit:  # noqa: ARG003
        return cls("current_limit", 10 * scales.torque)

    def act(self, run: Run, strength: float) -> None:
        run.change(current_limit=self.torque / strength)

    def parameters(self, strength: float) -> Parameters:
        return {"limit_deg_s2": self.torque / strength}


@dataclass(frozen=True)
class DroppedCommands(Effect):
    """The field bus loses bursts of commands; the drive keeps the last one it had."""

    burst_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> DroppedCommands:  # noqa: ARG003
        return cls("dropped_commands", log_uniform(rng, 0.1, 0.8))

    def _rate_hz(self, strength: float) -> float:
        return min(0.02 * strength, 0.3 / self.burst_s)

    def act(self, run: Run, strength: float) -> None:
        rng = run.rng(DROP_STREAM)
        length = max(1, round(self.burst_s * run.axis.sample_rate_hz))
        chance = rng.random(run.samples) < self._rate_hz(strength) / run.axis.sample_rate_hz
        lost = np.convolve(chance, np.ones(length), mode="full")[: run.samples] > 0
        lost[0] = False
        fresh = np.maximum.accumulate(np.where(lost, 0, np.arange(run.samples)))
        run.command = run.command[fresh]

    def parameters(self, strength: float) -> Parameters:
        return {"bursts_hz": self._rate_hz(strength), "burst_s": self.burst_s}


@dataclass(frozen=True)
class StuckBrake(Effect):
    """A brake drags on the load for a part of the record."""

    torque: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> StuckBrake:  # noqa: ARG003
        return cls("stuck_brake", 0.3 * scales.torque)

    def act(self, run: Run, strength: float) -> None:
        rng = run.rng(BRAKE_STREAM)
        begin = float(rng.uniform(0.05, 0.7)) * run.duration_s
        end = begin + float(rng.uniform(0.08, 0.25)) * run.duration_s
        on = (run.fine_time >= begin) & (run.fine_time < end)
        run.external[:, EXTERNAL_BRAKE] += strength * self.torque * on

    def parameters(self, strength: float) -> Parameters:
        return {"torque_deg_s2": strength * self.torque}


@dataclass(frozen=True)
class BoucWen(Effect):
    """A share of the gear's torque yields at an angle and closes a hysteresis loop (Wen 1976)."""

    yield_deg: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> BoucWen:
        return cls("bouc_wen", log_uniform(rng, 0.2, 1.0) * scales.twist)

    def act(self, run: Run, strength: float) -> None:
        run.change(yield_angle=self.yield_deg, yield_share=min(0.1 * strength, 0.8))

    def parameters(self, strength: float) -> Parameters:
        return {"yield_deg": self.yield_deg, "share": min(0.1 * strength, 0.8)}


@dataclass(frozen=True)
class PositionDependentMode(Effect):
    """Gear stiffness, and so the first mode, that changes with the axis' position."""

    period_deg: float
    phase: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> PositionDependentMode:
        return cls(
            "position_dependent_mode",
            log_uniform(rng, 0.8, 4.0) * scales.travel,
            float(rng.uniform(0, 2 * np.pi)),
        )

    def act(self, run: Run, strength: float) -> None:
        run.change(stiffness_wave=Wave(min(0.1 * strength, 0.45), 2 * np.pi / self.period_deg, self.phase))

    def parameters(self, strength: float) -> Parameters:
        return {"depth": min(0.1 * strength, 0.45), "period_axis_deg": self.period_deg}


@dataclass(frozen=True)
class SaturationRecovery(Effect):
    """After the limiter was reached, the command comes back slowly (wind-up behind it)."""

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> SaturationRecovery:  # noqa: ARG003
        return cls("saturation_recovery")

    def act(self, run: Run, strength: float) -> None:
        run.change(recovery_s=0.02 * strength)

    def parameters(self, strength: float) -> Parameters:
        return {"tau_s": 0.02 * strength}


@dataclass(frozen=True)
class InterpolationFault(Effect):
    """The encoder refreshes its fine interpolation only every few samples, its coarse lines always."""

    every: int
    coarse_deg: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> InterpolationFault:
        return cls("interpolation_fault", int(rng.integers(3, 9)), 2 * scales.sigma)

    def act(self, run: Run, strength: float) -> None:
        run.stale_every, run.coarse_step = self.every, strength * self.coarse_deg

    def parameters(self, strength: float) -> Parameters:
        return {"every": float(self.every), "coarse_deg": strength * self.coarse_deg}


@dataclass(frozen=True)
class CurvedCommand(Effect):
    """A command converter that is not linear: v (1 + a |v|)."""

    curvature: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CurvedCommand:
        return cls("curved_command", 0.05 * float(rng.choice([-1.0, 1.0])) / scales.limit)

    def act(self, run: Run, strength: float) -> None:
        run.change(curvature=float(np.clip(strength * self.curvature, -1.5, 1.5)))

    def parameters(self, strength: float) -> Parameters:
        return {"per_deg_s": strength * self.curvature}
