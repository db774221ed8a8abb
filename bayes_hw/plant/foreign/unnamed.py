"""Faults of a MuJoCo axis that no entry of the diagnosis' catalogue describes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.effects.effect import Parameters, Scales, log_uniform
from bayes_hw.plant.foreign.mechanics import DEGREE, ForeignEffect
from bayes_hw.plant.foreign.simulation import ForeignRun
from bayes_hw.plant.foreign.train import COM_OFFSET_M


@dataclass(frozen=True)
class Imbalance(ForeignEffect):
    """Gravity on a centre of mass off a level axis, trimmed where the record begins."""

    torque: float
    angle: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Imbalance:
        return cls("imbalance", 2 * scales.torque * DEGREE, float(rng.uniform(0, 2 * np.pi)))

    def act(self, run: ForeignRun, strength: float) -> None:
        run.gravity = strength * self.torque / (1e-3 * COM_OFFSET_M), self.angle

    def parameters(self, strength: float) -> Parameters:
        return {"torque_n_m": strength * self.torque}


@dataclass(frozen=True)
class QuadraticDrag(ForeignEffect):
    """A torque of the load that grows with the square of its speed."""

    drag: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> QuadraticDrag:  # noqa: ARG003
        return cls("quadratic_drag", 0.3 * scales.torque / (scales.speed**2 * DEGREE))

    def act(self, run: ForeignRun, strength: float) -> None:
        body, drag = run.train.load, strength * self.drag

        def law(k: int, q: Any, speed: Any, torques: Any) -> None:  # noqa: ARG001
            s = float(speed[body])
            torques[body] -= drag * s * abs(s)

        run.torques.append(law)

    def parameters(self, strength: float) -> Parameters:
        return {"n_m_s2_per_rad2": strength * self.drag}


@dataclass(frozen=True)
class TorqueLimit(ForeignEffect):
    """The drive gives no more than a largest torque; `derating` lets that fall to 40 % over the record."""

    torque: float
    duration_s: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> TorqueLimit:  # noqa: ARG003
        return cls("torque_limit", 10 * scales.torque * DEGREE, scales.duration_s)

    def act(self, run: ForeignRun, strength: float) -> None:
        largest = self.torque / strength
        fall = 0.6 * run.fine_time / self.duration_s if self.detail == "derating" else np.zeros(1)
        run.torque_limits = largest * (1 - fall)

    def parameters(self, strength: float) -> Parameters:
        return {"limit_n_m": self.torque / strength}


@dataclass(frozen=True)
class Derating(TorqueLimit):
    """A drive that grows warm gives ever less torque."""

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Derating:
        usual = TorqueLimit.draw(rng, scales)
        return cls("derating", usual.torque, usual.duration_s)


@dataclass(frozen=True)
class SlippingCoupling(ForeignEffect):
    """The gear's spring gives way where its torque exceeds what the coupling holds, and stays there."""

    torque: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> SlippingCoupling:  # noqa: ARG003
        return cls("slip", 3 * scales.torque * DEGREE)

    def act(self, run: ForeignRun, strength: float) -> None:
        spring, held = run.train.springs[run.train.gear], self.torque / strength
        one, other, stiffness = spring.one, spring.other, spring.stiffness
        widest, slid = held / stiffness, [0.0]

        def law(k: int, q: Any, speed: Any, torques: Any) -> None:  # noqa: ARG001
            d = float(q[one] - q[other])
            slid[0] = min(max(slid[0], d - widest), d + widest)
            torques[one] += stiffness * slid[0]
            torques[other] -= stiffness * slid[0]

        run.torques.append(law)

    def parameters(self, strength: float) -> Parameters:
        return {"holds_n_m": self.torque / strength}


@dataclass(frozen=True)
class LooseEncoder(ForeignEffect):
    """The disc slides on its shaft by a little whenever the shaft accelerates hard."""

    slide_deg: float
    share: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> LooseEncoder:
        return cls("loose_encoder", 0.3 * scales.sigma, float(rng.uniform(0.94, 0.99)))

    def act(self, run: ForeignRun, strength: float) -> None:
        substeps, slide, share = run.axis.substeps, strength * self.slide_deg, self.share

        def read(w: FloatArray) -> FloatArray:
            a = np.gradient(np.gradient(w[::substeps]))
            hard = np.abs(a) > np.quantile(np.abs(a), share)
            offset = np.cumsum(np.where(hard, -np.sign(a) * slide, 0.0))
            return np.asarray(w + np.repeat(offset, substeps)[: len(w)])

        run.encoder = read

    def parameters(self, strength: float) -> Parameters:
        return {"slide_deg": strength * self.slide_deg}


@dataclass(frozen=True)
class CurvedSensor(ForeignEffect):
    """The reading bends: y = w + b w^2, or by one bump over a stretch of the travel."""

    size_deg: float
    travel: float
    at: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CurvedSensor:
        return cls(
            str(rng.choice(["quadratic_sensor", "one_tooth"])),
            2 * scales.sigma,
            scales.travel,
            float(rng.uniform(-1, 1)) * scales.travel,
        )

    def act(self, run: ForeignRun, strength: float) -> None:
        size, travel, at = strength * self.size_deg, self.travel, self.at
        if self.detail == "quadratic_sensor":
            run.encoder = lambda w: w + size * (w / travel) ** 2
            return

        def bump(w: FloatArray) -> FloatArray:
            shape = 1 / (1 + ((w - at) / (0.15 * travel)) ** 4)
            return np.asarray(w + size * (shape - 1 / (1 + (at / (0.15 * travel)) ** 4)))

        run.encoder = bump

    def parameters(self, strength: float) -> Parameters:
        return {"size_deg": strength * self.size_deg}


@dataclass(frozen=True)
class EndStop(ForeignEffect):
    """MuJoCo's soft limit of a joint on one side of the travel: buffers that are met too early."""

    side: float
    travel: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> EndStop:
        return cls("end_stop", float(rng.choice([-1.0, 1.0])), scales.travel)

    def act(self, run: ForeignRun, strength: float) -> None:
        at = DEGREE * 2.5 * self.travel / strength**0.3
        run.stops = (-at, 1e3) if self.side < 0 else (-1e3, at)

    def parameters(self, strength: float) -> Parameters:
        return {"at_deg": self.side * 2.5 * self.travel / strength**0.3}


@dataclass(frozen=True)
class TachometerRipple(ForeignEffect):
    """The loop's measured speed is too large or small by a share that is periodic in the motor's angle."""

    period_deg: float
    phase: float
    largest = 60.0

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> TachometerRipple:
        period = log_uniform(rng, 0.06, 0.6) * scales.travel
        return cls("tachometer_ripple", period, float(rng.uniform(0, 2 * np.pi)))

    def act(self, run: ForeignRun, strength: float) -> None:
        share = min(0.01 * strength, 0.6)
        wavenumber, phase = 2 * np.pi / (self.period_deg * DEGREE), self.phase
        run.tachometer = lambda angle: 1 + share * math.sin(wavenumber * angle + phase)

    def parameters(self, strength: float) -> Parameters:
        return {"share": min(0.01 * strength, 0.6), "period_deg": self.period_deg}


@dataclass(frozen=True)
class TorqueDeadBand(ForeignEffect):
    """An amplifier or valve that gives no torque below a smallest demand."""

    torque: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> TorqueDeadBand:  # noqa: ARG003
        return cls("torque_dead_band", 0.1 * scales.torque * DEGREE)

    def act(self, run: ForeignRun, strength: float) -> None:
        run.torque_dead_band = strength * self.torque

    def parameters(self, strength: float) -> Parameters:
        return {"half_width_n_m": strength * self.torque}
