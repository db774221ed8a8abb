"""What every fault of the plant has: a name, a place, a size, and what it does to a record."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar, TypeAlias

import numpy as np

from bayes_hw.plant.strength import LARGEST

Parameters: TypeAlias = dict[str, float | str]


@dataclass(frozen=True)
class Scales:
    """Sizes natural to one axis and its records, in deg and s: a fault of strength 1 is of their order.

    `speed` is the largest the limiter lets pass, `travel` the spread of the angle, `torque` that of the gear
    in deg/s^2 of the load, `twist` the gear's angle under it; `modes_hz` the two modes of the drive.
    """

    speed: float
    travel: float
    torque: float
    twist: float
    sigma: float
    duration_s: float
    sample_rate_hz: float
    modes_hz: tuple[float, float]
    limit: float


@dataclass(frozen=True)
class Effect(ABC):
    """One fault with its shape drawn; its size is the `strength` given to `act`, zero for none."""

    label: ClassVar[str] = "other"
    """Label of the diagnosis' catalogue, or "other"."""
    detail: str
    """Which form of it."""

    @classmethod
    @abstractmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Effect:
        """A form and shape drawn at random."""

    @abstractmethod
    def act(self, run: Any, strength: float) -> None:
        """Change the run, that of a plant whose fault this is."""

    @property
    def largest(self) -> float:
        """The largest strength that makes sense."""
        return LARGEST

    @abstractmethod
    def parameters(self, strength: float) -> Parameters:
        """Its physical parameters at this strength, units in their names."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between `low` and `high`, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
