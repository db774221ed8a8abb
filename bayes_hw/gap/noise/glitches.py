"""Isolated samples far off their neighbours: encoder glitches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.noise.whitener import LOG_2PI, bridged_records, no_glitches

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


def find_glitches(residuals: Sequence[FloatArray]) -> list[BoolArray]:
    """A mask (samples,) a record of the samples that stand alone, none where there are too many of them."""
    departures = []
    for e in residuals:
        padded = np.pad(e, 2, mode="reflect")
        neighbours = np.stack([padded[:-4], padded[1:-3], padded[3:-1], padded[4:]])
        departures.append(e - np.median(neighbours, axis=0))
    every = np.abs(np.concatenate(departures))
    robust = 1.4826 * float(np.median(every))
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
