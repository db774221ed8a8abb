"""Backlash with memory (eq. 3 of the paper), which the model has as a static dead zone (eq. 5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError


class Branch(Protocol):
    """A strictly increasing function with its inverse: one flank of a backlash."""

    def __call__(self, w: float) -> float: ...

    def inverse(self, y: float) -> float: ...


@dataclass(frozen=True)
class LinearBranch:
    """y = slope (w - intercept); `intercept` is where the flank meets the horizontal axis."""

    slope: float
    intercept: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.slope) and self.slope > 0 and np.isfinite(self.intercept)):
            raise InputError("backlash branch: needs a positive slope and a finite intercept")

    def __call__(self, w: float) -> float:
        return self.slope * (w - self.intercept)

    def inverse(self, y: float) -> float:
        """w at which this flank gives y."""
        return y / self.slope + self.intercept


@dataclass(frozen=True)
class Backlash:
    """Backlash with memory (eq. 3): the output follows the increasing flank when pushed up, the decreasing
    one when pushed down, and stays where it is in between.

        y(k) = increasing(w(k))   if w(k) > increasing^-1(y(k-1))
               decreasing(w(k))   if w(k) < decreasing^-1(y(k-1))
               y(k-1)             otherwise
    """

    increasing: Branch
    decreasing: Branch

    @classmethod
    def play(cls, half_gap: float, slope: float = 1.0) -> Backlash:
        """Kinematic play of +-half_gap (units of w) with equal slopes."""
        return cls(LinearBranch(slope, half_gap), LinearBranch(slope, -half_gap))

    def __call__(self, w: FloatArray, initial: float = 0.0) -> FloatArray:
        """y for the sequence w, given the output before its first sample.

        Raises InputError when the flanks cross within the sequence, where eq. 3 has no meaning.
        """
        w = np.asarray(w, dtype=np.float64)
        y = np.empty_like(w)
        held = float(initial)
        for k, position in enumerate(w):
            engaged_up, engaged_down = self.increasing.inverse(held), self.decreasing.inverse(held)
            if engaged_down > engaged_up:
                raise InputError("backlash: its two flanks cross; the gap must not be negative")
            if position > engaged_up:
                held = self.increasing(position)
            elif position < engaged_down:
                held = self.decreasing(position)
            y[k] = held
        return y
