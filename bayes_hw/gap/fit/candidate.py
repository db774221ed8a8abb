"""A start of a fit: an effect at parameter values, and what it promises there."""

from __future__ import annotations

from dataclasses import dataclass

from bayes_hw.gap.effects.effect import Effect


@dataclass(frozen=True)
class Candidate:
    """A start for an effect: parameter values and the reduction it promises."""

    effect: Effect
    values: tuple[float, ...]
    reduction: float
