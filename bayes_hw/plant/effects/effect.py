"""What every fault of the plant has: a name, a place, a size, and what it does to a record."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from inspect import isabstract
from types import ModuleType
from typing import Any, ClassVar, TypeAlias

import numpy as np

TOLERANCE = 0.04
MOST_EVALUATIONS = 12
ENOUGH, GOOD_ENOUGH = 6, 0.15
LARGEST_STEP = 10.0
SMALLEST, LARGEST = 1e-4, 1e5


def strength_for_gap(
    gap: Callable[[float], float], target: float, largest: float = LARGEST
) -> tuple[float, float]:
    """(strength, gap there), the gap within 4 % (15 % after six trials) of the target where one is found.

    A secant search in logarithms between 1e-4 and `largest`, kept inside the bracket once there is one, as
    gaps grow about in proportion to the strength. Where the gap jumps over the target or stays below it, the
    closest of those tried is returned; a strength whose response is not finite counts as too strong.
    """
    low, high = np.log(SMALLEST), np.log(largest)
    below: tuple[float, float] | None = None
    above: tuple[float, float] | None = None
    best = (np.inf, 0.0, 0.0)
    x = min(0.0, float(high))
    tried: set[float] = set()
    for number in range(1, MOST_EVALUATIONS + 1):
        tried.add(x)
        size = gap(float(np.exp(x)))
        error = np.log(size / target) if np.isfinite(size) and size > 0 else (-20.0 if size == 0 else 20.0)
        if abs(error) < best[0]:
            best = (abs(error), float(np.exp(x)), size)
        if best[0] < np.log1p(TOLERANCE if number < ENOUGH else GOOD_ENOUGH):
            break
        if error < 0:
            below = (x, error)
        else:
            above = (x, error)
        x = float(np.clip(_next(x, error, below, above), low, high))
        if x in tried:
            break
    return best[1], best[2]


def _next(
    x: float, error: float, below: tuple[float, float] | None, above: tuple[float, float] | None
) -> float:
    if below is None or above is None:
        return x - float(np.clip(error, -np.log(LARGEST_STEP), np.log(LARGEST_STEP)))
    share = -below[1] / (above[1] - below[1])
    return below[0] + float(np.clip(share, 0.1, 0.9)) * (above[0] - below[0])


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


def faults_of(*modules: ModuleType) -> tuple[type[Effect], ...]:
    """The faults that these modules define, in the order in which they do."""
    return tuple(
        found
        for module in modules
        for found in vars(module).values()
        if isinstance(found, type)
        and issubclass(found, Effect)
        and found.__module__ == module.__name__
        and not isabstract(found)
    )


def with_own(catalogue: Iterable[type[Effect]], own: Iterable[type[Effect]]) -> tuple[type[Effect], ...]:
    """The catalogue of another plant with its `own` fault of a label in place of the other's."""
    by_label = {fault.label: fault for fault in own}
    return tuple(by_label.get(fault.label, fault) for fault in catalogue)


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A number between `low` and `high`, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))
