"""outliers: isolated samples far off their neighbours, glitches of the encoder.

Beside slow noise they stand out of their neighbours whatever is slow beneath: it is fitted to the other
samples, and glitches add the likelihood of their places and heights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, NamedTuple

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, robust_sigma
from bayes_hw.gap.noise.misfit import Misfit
from bayes_hw.gap.noise.random_cause import GLITCHES
from bayes_hw.gap.noise.state_noise import StateNoise
from bayes_hw.gap.noise.stochastic_fit import NOISE_ORDER, StochasticFit
from bayes_hw.gap.noise.whitener import (
    LOG_2PI,
    Autoregression,
    bridged_records,
    fit_autoregression,
    no_glitches,
)

FAR = 6.0
"""Robust standard deviations off the neighbours' median."""

LARGEST_SHARE = 0.06
"""A larger share of far samples is no glitches but another distribution."""

FEWEST = 3

CLOSE = 3
LARGEST_CROWD = 0.5
"""A larger share of far samples with another at most CLOSE samples away is no glitches but ringing."""


class Glitches(NamedTuple):
    """Glitches of all records: masks (samples,), a record each, and the root mean square of their heights."""

    masks: list[BoolArray]
    height: float

    @property
    def found(self) -> int:
        return sum(int(mask.sum()) for mask in self.masks)

    @property
    def samples(self) -> int:
        return sum(len(mask) for mask in self.masks)

    @property
    def rate(self) -> float:
        """How many a sample."""
        return self.found / self.samples

    @property
    def log_likelihood(self) -> float:
        """Of which samples are glitches, and of their heights, beside that of the other samples' noise."""
        wide = -0.5 * self.found * (LOG_2PI + 1) - self.found * np.log(self.height)
        others = (self.samples - self.found) * np.log1p(-self.rate)
        return float(wide + self.found * np.log(self.rate) + others)

    def parameters(self, unit: str) -> dict[str, tuple[float, float, str]]:
        """Rate and height with their standard deviations; `unit` is that of the output."""
        return {
            "outliers.rate": (self.rate, float(np.sqrt(self.rate / self.samples)), ""),
            "outliers.height": (self.height, float(self.height / np.sqrt(2 * self.found)), unit),
        }

    @classmethod
    def of(cls, residuals: Sequence[FloatArray]) -> Glitches | None:
        """Those of residuals (samples,), a record each; None where there are fewer than FEWEST."""
        masks = find_glitches(residuals)
        beneath = bridged_records(residuals, masks)
        heights = np.concatenate([(e - b)[m] for e, b, m in zip(residuals, beneath, masks, strict=True)])
        return cls(masks, float(np.sqrt(np.mean(heights**2)))) if len(heights) >= FEWEST else None


@dataclass(frozen=True)
class SecondGlitches:
    """Glitches that were found, and the misfit with them bridged; see `SecondCause`."""

    label: ClassVar[str] = GLITCHES.label
    form: ClassVar[str] = "with glitches"
    rounds: ClassVar[int] = 0

    misfit: Misfit
    glitches: Glitches

    @classmethod
    def of(cls, fit: Misfit) -> SecondGlitches | None:
        """Those of the residuals; None without glitches."""
        glitches = Glitches.of(fit.residuals)
        if glitches is None:
            return None
        return cls(fit.with_residuals(bridged_records(fit.residuals, glitches.masks)), glitches)

    @property
    def variances(self) -> list[FloatArray]:
        return [np.where(mask, np.inf, 0.0) for mask in self.glitches.masks]

    def log_likelihood(self, noise: StateNoise) -> float:  # noqa: ARG002
        return self.glitches.log_likelihood

    @property
    def parameters(self) -> dict[str, tuple[float, float, str]]:
        return self.glitches.parameters(self.misfit.scale.units.output)

    def beside(self, noise: StateNoise) -> SecondGlitches:  # noqa: ARG002
        """Glitches stay where they are."""
        return self


def outliers(fit: Misfit) -> StochasticFit | None:
    """Glitches in the residuals of `fit`: the likelihood of the mixture of both kinds of sample."""
    glitches = Glitches.of(fit.residuals)
    if glitches is None:
        return None
    noise = fit_autoregression(fit.residuals, glitches.masks, NOISE_ORDER, fit.unread)
    total = noise.log_likelihood + glitches.log_likelihood
    whitener = replace(noise, log_likelihood=total, parameter_count=Autoregression.parameter_count)
    return StochasticFit(GLITCHES.label, "", whitener, total, glitches.parameters(fit.scale.units.output))


def find_glitches(residuals: Sequence[FloatArray]) -> list[BoolArray]:
    """A mask (samples,) a record of the samples that stand alone, none where there are too many of them."""
    departures = []
    for e in residuals:
        padded = np.pad(e, 2, mode="reflect")
        neighbours = np.stack([padded[:-4], padded[1:-3], padded[3:-1], padded[4:]])
        departures.append(e - np.median(neighbours, axis=0))
    every = np.abs(np.concatenate(departures))
    robust = robust_sigma(every)
    masks = [np.abs(d) > FAR * robust for d in departures]
    share = sum(int(mask.sum()) for mask in masks) / len(every)
    if robust == 0 or share > LARGEST_SHARE or _crowded(masks) > LARGEST_CROWD:
        return no_glitches(residuals)
    return masks


def _crowded(masks: Sequence[BoolArray]) -> float:
    """Share of the masked samples that have another at most CLOSE samples away; zero of none."""
    crowded = total = 0
    for mask in masks:
        apart = np.diff(np.flatnonzero(mask), prepend=-len(mask), append=2 * len(mask))
        crowded += int(np.sum(np.minimum(apart[:-1], apart[1:]) <= CLOSE)) if mask.any() else 0
        total += int(mask.sum())
    return crowded / max(total, 1)
