"""Families of commands for the next experiment, each with settings to be optimised."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.motion_limits import MotionLimits
from bayes_hw.model.blocks import Saturation
from bayes_hw.model.excitation import (
    amplitude_modulated_sweep,
    balancing_offset,
    phase_modulated_sweep,
    random_phase_multisine,
    sine_sweep,
    staircase,
)

HIGHEST_SHARE_OF_RATE = 0.4
"""Highest frequency of any family, as a share of the sample rate."""

SMALLEST_SHARE = 0.02
"""Smallest amplitude, as a share of the velocity limit."""

START_PHASE_RAD = -np.pi / 4
STAIRS = 4
LONGEST_HOLD_SHARE = 1 / 8
FEWEST_HOLD_SAMPLES = 4


@dataclass(frozen=True)
class Circumstances:
    """What every family needs to know of the experiment: its length, the limits, the saturation as believed,
    and the seed of random phases."""

    sample_rate_hz: float
    duration_s: float
    limits: MotionLimits
    saturation: Saturation
    phase_seed: int = 0

    @property
    def samples(self) -> int:
        return round(self.duration_s * self.sample_rate_hz)


@dataclass(frozen=True)
class Setting:
    """One number to be chosen between two ends, evenly or evenly in its logarithm."""

    name: str
    low: float
    high: float
    logarithmic: bool = True

    def value(self, share: float) -> float:
        """The setting at a share between 0 and 1 of its range."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** share
        return self.low + share * (self.high - self.low)

    def share(self, value: float) -> float:
        """The inverse of `value`."""
        if self.logarithmic:
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)


@dataclass(frozen=True)
class Family:
    """Commands of one kind: `make` turns values of `settings` into samples, before any limit is applied."""

    name: str
    label: str
    settings: tuple[Setting, ...]
    make: Callable[[Mapping[str, float]], FloatArray]

    def values(self, shares: FloatArray) -> dict[str, float]:
        """Settings at shares (settings,) of their ranges."""
        return {s.name: s.value(float(share)) for s, share in zip(self.settings, shares, strict=True)}

    def shares(self, values: Mapping[str, float]) -> dict[str, float]:
        """The shares of their ranges at which the settings have these values."""
        return {s.name: s.share(values[s.name]) for s in self.settings}


def families(circumstances: Circumstances) -> tuple[Family, ...]:
    """Plain, amplitude-modulated and phase-modulated sweeps (the last two the paper's proposal, section 4),
    random-phase multisines and staircases with reversals.

    `offset_share` adds that share of the constant that keeps an axis with unequal limits from drifting: below
    and above one it drifts one way or the other, through the dead zone and away.
    """
    c, largest = circumstances, circumstances.limits.velocity
    slowest, highest = 1 / c.duration_s, HIGHEST_SHARE_OF_RATE * c.sample_rate_hz
    amplitude = Setting("amplitude", SMALLEST_SHARE * largest, largest)
    stop = Setting("stop_hz", min(10 * slowest, highest / 2), highest)
    offset = Setting("offset_share", 0.0, 2.0, logarithmic=False)
    modulation = Setting("modulation_hz", slowest, min(1.0, highest / 4))
    shortest_hold = FEWEST_HOLD_SAMPLES / c.sample_rate_hz
    return (
        Family("plain_sweep", "plain sweep", (amplitude, stop, offset), partial(_swept, sine_sweep, (), c)),
        Family(
            "amplitude_modulated_sweep",
            "amplitude-modulated sweep",
            (amplitude, stop, offset, modulation, Setting("depth", 0.0, 1.0, logarithmic=False)),
            partial(_swept, amplitude_modulated_sweep, ("modulation_hz", "depth"), c),
        ),
        Family(
            "phase_modulated_sweep",
            "phase-modulated sweep",
            (amplitude, stop, offset, modulation, Setting("deviation_rad", 0.5, 30.0)),
            partial(_swept, phase_modulated_sweep, ("modulation_hz", "deviation_rad"), c),
        ),
        Family(
            "random_phase_multisine",
            "random-phase multisine",
            (
                Setting("rms", SMALLEST_SHARE * largest, largest),
                Setting("start_hz", slowest, max(2 * slowest, highest / 20)),
                stop,
                offset,
            ),
            partial(_multisine, c),
        ),
        Family(
            "staircase",
            "staircase with reversals",
            (
                Setting("top_level", SMALLEST_SHARE * largest, largest),
                Setting("lowest_share", 0.03, 0.9),
                Setting("hold_s", shortest_hold, LONGEST_HOLD_SHARE * c.duration_s / STAIRS),
                offset,
            ),
            partial(_staircase, c),
        ),
    )


def _swept(
    sweep: Callable[..., FloatArray], names: Sequence[str], c: Circumstances, s: Mapping[str, float]
) -> FloatArray:
    """A sweep up to `stop_hz` from zero, with its own settings `names`."""
    own = {name: s[name] for name in names}
    u = sweep(
        c.sample_rate_hz,
        c.duration_s,
        s["amplitude"],
        0.0,
        s["stop_hz"],
        start_phase_rad=START_PHASE_RAD,
        **own,
    )
    return _with_offset(c, u, s)


def _multisine(c: Circumstances, s: Mapping[str, float]) -> FloatArray:
    start = min(s["start_hz"], s["stop_hz"] - 2 / c.duration_s)
    signal = random_phase_multisine(
        np.random.default_rng(c.phase_seed), c.sample_rate_hz, c.duration_s, s["rms"], start, s["stop_hz"]
    )
    return _with_offset(c, signal, s)


def _staircase(c: Circumstances, s: Mapping[str, float]) -> FloatArray:
    """Four levels in geometric ratio, up and mirrored, repeated while they last, then cut to length."""
    levels = s["top_level"] * np.geomspace(s["lowest_share"], 1.0, STAIRS)
    hold_s = max(s["hold_s"], FEWEST_HOLD_SAMPLES / c.sample_rate_hz)
    period = 2 * STAIRS * round(hold_s * c.sample_rate_hz)
    signal = staircase(c.sample_rate_hz, hold_s, levels.tolist(), max(1, c.samples // period))
    whole = np.zeros(c.samples)
    count = min(len(signal), c.samples)
    whole[:count] = signal[:count]
    return _with_offset(c, whole, s)


def _with_offset(c: Circumstances, u: FloatArray, s: Mapping[str, float]) -> FloatArray:
    return u + s["offset_share"] * balancing_offset(u, c.saturation)
