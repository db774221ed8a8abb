"""The catalogue of random causes and of their pairs, each with what fits it to a misfit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from bayes_hw.gap.noise.clock_jitter import SecondJitter, clock_jitter
from bayes_hw.gap.noise.glitches import SecondGlitches, outliers
from bayes_hw.gap.noise.held_samples import held_samples
from bayes_hw.gap.noise.random_cause import GLITCHES, JITTER, WALK, WIND, RandomCause
from bayes_hw.gap.noise.rounding import SecondRounding
from bayes_hw.gap.noise.slow_noise import random_walk, wind
from bayes_hw.gap.noise.stochastic_fit import StochasticFit
from bayes_hw.gap.noise.two_causes import both

FitNoise: TypeAlias = Callable[..., StochasticFit | None]
"""Fits noise to a `Misfit`; slow noise also from a `start` of its parameters."""


@dataclass(frozen=True)
class NoiseKind:
    """A random cause in one form, or two at once; `second` is the label of the other."""

    cause: RandomCause
    form: str
    fit: FitNoise
    second: str | None = None

    @property
    def key(self) -> tuple[str, str]:
        """Label and form, as a `StochasticFit` has them."""
        return self.cause.label, self.form


SLOW = (NoiseKind(WIND, "", wind), NoiseKind(WALK, "random walk", random_walk))

ONE_CAUSE = (
    NoiseKind(GLITCHES, "", outliers),
    NoiseKind(JITTER, "clock", clock_jitter),
    NoiseKind(JITTER, "held samples", held_samples),
    *SLOW,
)
"""Rounding of the records is a fact that needs no search."""

TWO_CAUSES = tuple(
    NoiseKind(
        slow.cause,
        ", ".join(filter(None, [slow.form, second.form])),
        both(slow.fit, second.of),
        second.label,
    )
    for second in (SecondGlitches, SecondJitter, SecondRounding)
    for slow in SLOW
)
