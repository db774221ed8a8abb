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
    """One kind of blind set; `rates_hz` and `durations_s` list the values, other ranges are of uniform or
    log-uniform draws.

    `excitations` names the families of the training commands and, last, of the hold-out's; empty for two or
    three drawn at random. `gap_over_sigma` is the size of every gap; `noise_share` and `dead_zone_share` are
    sigma and half width over the spread of the outputs. In `slow_share` of the cases the axis is up to ten
    times slower. `off_catalogue` is the key in OFF_CATALOGUES of what "other" is drawn from;
    `plant` names what makes axes and faults: "home", "mujoco" (`bayes_hw.plant.foreign`) or "beam".
    """

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
    excitations: tuple[str, ...]
    slow_share: float = 0.0
    none_share: float = 0.2
    other_share: float = 0.15
    pair_share: float = 0.15
    off_catalogue: str = "known"
    plant: str = "home"

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

CAMPAIGN = ("modulated_sweep", "steps_and_triangles", "pink_multisine", "acceptance_run")

KINDS: Mapping[str, Kind] = {
    "easy": Kind(
        name="easy",
        rates_hz=(20.0,),
        durations_s=(120.0,),
        diameter_m=(22.0, 36.0),
        first_damping=(0.025, 0.10),
        noise_share=(0.005, 0.013),
        dead_zone_share=(0.03, 0.16),
        gap_over_sigma=(1.5, 6.0),
        coloured_share=0.0,
        spread=NEAR_SPREAD,
        excitations=CAMPAIGN,
    ),
    "hard": Kind(
        name="hard",
        rates_hz=(20.0, 20.0, 25.0, 50.0),
        durations_s=(60.0, 120.0, 120.0, 200.0),
        diameter_m=(22.0, 36.0),
        first_damping=(0.025, 0.10),
        noise_share=(0.005, 0.013),
        dead_zone_share=(0.02, 0.14),
        gap_over_sigma=(0.7, 4.0),
        coloured_share=0.5,
        spread=FORMAT_SPREAD,
        excitations=CAMPAIGN,
    ),
    "wide": Kind(
        name="wide",
        rates_hz=(10.0, 20.0, 40.0, 50.0, 100.0, 200.0),
        durations_s=(60.0, 90.0, 150.0, 240.0),
        diameter_m=(18.0, 80.0),
        first_damping=(0.008, 0.12),
        noise_share=(0.0005, 0.02),
        dead_zone_share=(0.005, 0.2),
        gap_over_sigma=(0.7, 6.0),
        coloured_share=0.5,
        spread=FORMAT_SPREAD,
        excitations=(),
        slow_share=0.3,
    ),
    "mujoco": Kind(
        name="mujoco",
        rates_hz=(20.0, 25.0, 40.0, 50.0),
        durations_s=(60.0, 90.0, 120.0),
        diameter_m=(22.0, 36.0),
        first_damping=(0.025, 0.10),
        noise_share=(0.003, 0.013),
        dead_zone_share=(0.02, 0.14),
        gap_over_sigma=(0.8, 5.0),
        coloured_share=0.3,
        spread=FORMAT_SPREAD,
        excitations=(),
        plant="mujoco",
    ),
    "beam": Kind(
        name="beam",
        rates_hz=(20.0, 25.0, 40.0, 40.0, 50.0, 50.0, 100.0, 200.0),
        durations_s=(60.0, 90.0, 120.0),
        diameter_m=(22.0, 36.0),
        first_damping=(0.025, 0.10),
        noise_share=(0.003, 0.013),
        dead_zone_share=(0.01, 0.14),
        gap_over_sigma=(0.8, 5.0),
        coloured_share=0.3,
        spread=FORMAT_SPREAD,
        excitations=(),
        plant="beam",
    ),
}
"""easy: one rate and length, simulator nearly right, white noise. hard: other rates and lengths, weaker gaps,
noise coloured in half of the cases, simulator as far off as the formats say. wide: beyond both, in rates,
lengths, dishes, excitations and sizes. mujoco: drive trains and loops of other shapes, by MuJoCo. beam: of
finite elements, with geared stages, one motor or two and current loops."""
