"""Faults of the linear dynamics: more delay, a missing mode, a stiffening spring."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from bayes_hw.plant.drive_train import Appendage
from bayes_hw.plant.effects.effect import Effect, Parameters, Scales, log_uniform
from bayes_hw.plant.run import RecordRun, Run

CLEAR_OF_MODES = 0.12
LONGEST_EXTRA_DELAY_S = 0.2
MASS_RATIO = 0.02
LARGEST_MASS_RATIO = 0.3
LARGEST_SOFTENING = 0.06
"""|b| D^2 at the root mean square twist: at four times that the torque is still rising with the twist."""


def frequency_clear_of_modes(
    rng: np.random.Generator, scales: Scales, lowest_share: float, largest_share: float
) -> float:
    """A frequency (Hz) CLEAR_OF_MODES, from `lowest_share` of the first of them to well above the last and at
    most `largest_share` of the sample rate."""
    low, high = min(scales.modes_hz), max(scales.modes_hz)
    while True:
        hz = log_uniform(rng, lowest_share * low, min(1.8 * high, largest_share * scales.sample_rate_hz))
        if min(abs(hz / low - 1), abs(hz / high - 1)) > CLEAR_OF_MODES:
            return hz


@dataclass(frozen=True)
class TransportDelay(Effect):
    """More delay of the command than the simulator has, a fraction of a sample or several."""

    label: ClassVar[str] = "transport_delay"
    sample_rate_hz: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> TransportDelay:  # noqa: ARG003
        return cls("delay", scales.sample_rate_hz)

    @property
    def largest(self) -> float:
        return LONGEST_EXTRA_DELAY_S * self.sample_rate_hz

    def act(self, run: RecordRun, strength: float) -> None:
        run.extra_delay_s += strength / self.sample_rate_hz

    def parameters(self, strength: float) -> Parameters:
        return {"samples": strength}


@dataclass(frozen=True)
class UnmodelledMode(Effect):
    """A mass on a spring at the load (a counterweight) or at the structure (feed legs, a subreflector)."""

    label: ClassVar[str] = "unmodelled_mode"
    hz: float
    damping_ratio: float
    largest = LARGEST_MASS_RATIO / MASS_RATIO

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> UnmodelledMode:
        hz = frequency_clear_of_modes(rng, scales, 0.45, 0.4)
        return cls(
            str(rng.choice(["at_load", "at_structure"], p=[0.7, 0.3])), hz, log_uniform(rng, 0.005, 0.03)
        )

    def act(self, run: Run, strength: float) -> None:
        at_structure = self.detail == "at_structure"
        host = run.drive.structure_inertia if at_structure else 1.0
        appendage = Appendage(MASS_RATIO * strength * host, self.hz, self.damping_ratio, at_structure)
        run.drive = replace(run.drive, appendage=appendage)

    def parameters(self, strength: float) -> Parameters:
        return {
            "kind": self.detail,
            "hz": self.hz,
            "damping_ratio": self.damping_ratio,
            "mass_ratio": MASS_RATIO * strength,
        }


@dataclass(frozen=True)
class CubicStiffness(Effect):
    """Gear torque k D (1 + b D^2) when it stiffens, k D / (1 + |b| D^2) when it softens."""

    label: ClassVar[str] = "cubic_stiffness"
    twist: float

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> CubicStiffness:
        return cls(str(rng.choice(["stiffening", "softening"], p=[0.7, 0.3])), scales.twist)

    @property
    def largest(self) -> float:
        return super().largest if self.detail == "stiffening" else LARGEST_SOFTENING / 0.03

    def _per_deg2(self, strength: float) -> float:
        return (1 if self.detail == "stiffening" else -1) * 0.03 * strength / self.twist**2

    def act(self, run: Run, strength: float) -> None:
        run.change(cubic=self._per_deg2(strength))

    def parameters(self, strength: float) -> Parameters:
        return {"kind": self.detail, "k3_over_k": self._per_deg2(strength)}
