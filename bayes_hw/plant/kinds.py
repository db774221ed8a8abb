"""How the cases of a blind set are spread: plants, records, noise, faults, and how wrong the simulator is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.plant.effects import CATALOGUE
from bayes_hw.plant.effects.effect import log_uniform
from bayes_hw.plant.nominal import Nominal

LABELS = tuple(effect.label for effect in CATALOGUE)


@dataclass(frozen=True)
class Spread:
    """Relative standard deviations of a nominal model's parameters; `uniform` stays within 1.7 of them."""

    limits: float
    gain: float
    frequency: float
    damping: float
    half_width: float
    sigma: float
    uniform: bool

    def factor(self, rng: np.random.Generator, deviation: float) -> float:
        """A positive factor about one."""
        if self.uniform:
            return float(np.exp(rng.uniform(-1.7, 1.7) * deviation))
        return float(np.exp(rng.standard_normal() * deviation))


@dataclass(frozen=True)
class Kind:
    """One kind of blind set; ranges are of log-uniform draws unless they list the values."""

    name: str
    rates_hz: tuple[float, ...]
    durations_s: tuple[float, ...]
    diameter_m: tuple[float, float]
    first_damping: tuple[float, float]
    noise_share: tuple[float, float]
    dead_zone_share: tuple[float, float]
    gap_over_sigma: tuple[float, float]
    coloured_share: float
    spread: Spread
    every_excitation: bool
    slow_share: float = 0.0
    none_share: float = 0.2
    other_share: float = 0.15
    pair_share: float = 0.15

    def draw_labels(self, rng: np.random.Generator) -> list[str]:
        """No label, one of the catalogue, two of it, or `other`, in the stated shares."""
        x = rng.random()
        if x < self.none_share:
            return []
        if x < self.none_share + self.other_share:
            return ["other"]
        count = 2 if x < self.none_share + self.other_share + self.pair_share else 1
        return [str(label) for label in rng.choice(LABELS, count, replace=False)]

    def speed(self, rng: np.random.Generator) -> float:
        """A factor on the limits: one, or down to a tenth for slow axes."""
        return log_uniform(rng, 0.1, 1.0) if rng.random() < self.slow_share else 1.0

    def misjudge(self, rng: np.random.Generator, true: Nominal) -> Nominal:
        """A simulator whose base parameters are off as the spread says."""
        s = self.spread
        return replace(
            true,
            lower=true.lower * s.factor(rng, s.limits),
            upper=true.upper * s.factor(rng, s.limits),
            half_width=true.half_width * s.factor(rng, s.half_width),
            gain=true.gain * s.factor(rng, s.gain),
            modes=tuple(
                (f * s.factor(rng, s.frequency), min(z * s.factor(rng, s.damping), 0.5))
                for f, z in true.modes
            ),
        )

    def misjudged_sigma(self, rng: np.random.Generator) -> float:
        """A factor on the noise that the simulator's file states."""
        return self.spread.factor(rng, self.spread.sigma)


FORMAT_SPREAD = Spread(0.06, 0.05, 0.025, 0.30, 0.50, 0.12, uniform=False)
NEAR_SPREAD = Spread(0.02, 0.017, 0.012, 0.09, 0.17, 0.14, uniform=True)

KINDS: Mapping[str, Kind] = {
    "easy": Kind(
        "easy",
        (20.0,),
        (120.0,),
        (22.0, 36.0),
        (0.025, 0.10),
        (0.005, 0.013),
        (0.03, 0.16),
        (1.5, 6.0),
        0.0,
        NEAR_SPREAD,
        every_excitation=False,
    ),
    "hard": Kind(
        "hard",
        (20.0, 20.0, 25.0, 50.0),
        (60.0, 120.0, 120.0, 200.0),
        (22.0, 36.0),
        (0.025, 0.10),
        (0.005, 0.013),
        (0.02, 0.14),
        (0.7, 4.0),
        0.5,
        FORMAT_SPREAD,
        every_excitation=False,
    ),
    "wide": Kind(
        "wide",
        (10.0, 20.0, 40.0, 50.0, 100.0, 200.0),
        (60.0, 90.0, 150.0, 240.0),
        (18.0, 80.0),
        (0.008, 0.12),
        (0.003, 0.02),
        (0.005, 0.2),
        (0.7, 6.0),
        0.5,
        FORMAT_SPREAD,
        every_excitation=True,
        slow_share=0.3,
    ),
}
