"""Commands that show an effect, ready to play: what `next_experiment` of a verdict says in words.

Every label has a play, a function of what the axis may do; `PLAYS` names it. Slow triangles are of the angle:
a command to one side and to the other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.identifiability.excitation_families import HIGHEST_SHARE_OF_RATE
from bayes_hw.identifiability.motion_limits import MotionLimits, kept_within
from bayes_hw.model.excitation import random_phase_multisine, sine_sweep

REST_S = 3.0
SLOW_LEVELS = (0.04, 0.12, 0.4)
"""Speeds of slow triangles, in units of the largest command."""

REVERSALS = 4
STROKE_SHARE = 0.8


@dataclass(frozen=True)
class Stage:
    """What a play needs to know: rate and length of the record, what the axis may do, and the steady speed in
    output units/s of a command of one."""

    sample_rate_hz: float
    duration_s: float
    limits: MotionLimits
    gain: float

    @property
    def swing(self) -> float:
        """The largest amplitude of the angle about where the axis begins, at zero."""
        return STROKE_SHARE * max(min(-self.limits.lowest, self.limits.highest), 0.0)

    def hold(self, level: float, seconds: float) -> FloatArray:
        """A constant command."""
        return np.full(max(round(seconds * self.sample_rate_hz), 1), level)

    def rest(self) -> FloatArray:
        return self.hold(0.0, REST_S)


Play: TypeAlias = Callable[[Stage], Sequence[FloatArray]]


def triangles(stage: Stage) -> Sequence[FloatArray]:
    """Slow triangles of the angle at three rates, rests between."""
    parts, each = [stage.rest()], stage.duration_s / len(SLOW_LEVELS)
    for share in SLOW_LEVELS:
        level = share * stage.limits.velocity
        longest = 2 * stage.swing / max(abs(stage.gain) * level, 1e-300)
        half = min((each - REST_S) / (REVERSALS + 1), longest)
        signs = [0.5, *([-1.0, 1.0] * REVERSALS)[: REVERSALS - 1], 0.5 * (-1.0) ** REVERSALS]
        parts += [stage.hold(level * np.sign(s), half * abs(s)) for s in signs]
        parts.append(stage.rest())
    return parts


def two_triangles(stage: Stage) -> Sequence[FloatArray]:
    """Slow reversals at two amplitudes."""
    level, parts = SLOW_LEVELS[1] * stage.limits.velocity, [stage.rest()]
    for share in (0.25, 1.0):
        half = share * min(
            2 * stage.swing / max(abs(stage.gain) * level, 1e-300), stage.duration_s / 2 / (REVERSALS + 1)
        )
        for i in range(REVERSALS):
            ends = i in (0, REVERSALS - 1)
            parts.append(stage.hold(level * (-1.0) ** i, half * (0.5 if ends else 1.0)))
        parts.append(stage.rest())
    return parts


def travel(stage: Stage) -> Sequence[FloatArray]:
    """The travel at two constant speeds, in both directions."""
    parts = [stage.rest()]
    for share in (0.1, 0.4):
        level = share * stage.limits.velocity
        there = min(2 * stage.swing / max(abs(stage.gain) * level, 1e-300), stage.duration_s / 5)
        parts += [stage.hold(-level, there / 2), stage.hold(level, there), stage.hold(-level, there / 2)]
        parts.append(stage.rest())
    return parts


def steps(stage: Stage) -> Sequence[FloatArray]:
    """Steps of four sizes to either side, the largest beyond the limits, each held."""
    hold = min(4.0, stage.duration_s / 20)
    parts = [stage.rest()]
    for share in (0.15, 0.4, 0.7, 1.0):
        level = share * stage.limits.velocity
        held = min(hold, stage.swing / max(abs(stage.gain) * level, 1e-300))
        parts += [stage.hold(level, held), stage.hold(0.0, hold / 2), stage.hold(-level, held)]
        parts.append(stage.hold(0.0, hold / 2))
    return parts


def sweeps(stage: Stage) -> Sequence[FloatArray]:
    """The same sweep at two amplitudes."""
    rate, parts = stage.sample_rate_hz, [stage.rest()]
    seconds = stage.duration_s / 2 - 2 * REST_S
    for share in (0.3, 1.0):
        lowest = max(share * stage.limits.velocity * abs(stage.gain) / (2 * np.pi * stage.swing), 2 / seconds)
        sweep = sine_sweep(rate, seconds, share * stage.limits.velocity, lowest, HIGHEST_SHARE_OF_RATE * rate)
        parts += [sweep - sweep.mean(), stage.rest()]
    return parts


def multisine(stage: Stage) -> Sequence[FloatArray]:
    """A fast multisine between rests."""
    rate, seconds = stage.sample_rate_hz, stage.duration_s - 2 * REST_S
    signal = random_phase_multisine(
        np.random.default_rng(1),
        rate,
        seconds,
        0.4 * stage.limits.velocity,
        min(0.5, 0.1 * rate),
        HIGHEST_SHARE_OF_RATE * rate,
    )
    return [stage.rest(), signal, stage.rest()]


def motion_then_rest(stage: Stage) -> Sequence[FloatArray]:
    """Slow reversals for half of the time, then rest."""
    short = Stage(stage.sample_rate_hz, stage.duration_s / 2, stage.limits, stage.gain)
    moved = np.concatenate(list(two_triangles(short)))
    return [moved, stage.hold(0.0, stage.duration_s / 2)]


PLAYS: Mapping[str, tuple[str, Play]] = MappingProxyType(
    {
        "rate_limit": ("steps of four sizes", steps),
        "saturation_drift": ("the travel at two speeds, in both directions", travel),
        "command_bias": ("slow reversals, then rest", motion_then_rest),
        "gain_drift": ("slow triangles at three rates", triangles),
        "cubic_stiffness": ("the same sweep at two amplitudes", sweeps),
        "friction": ("slow triangles at three rates", triangles),
        "backlash": ("slow reversals at two amplitudes", two_triangles),
        "torque_ripple": ("the travel at two speeds, in both directions", travel),
        "wind": ("slow reversals, then rest", motion_then_rest),
        "encoder_quantization": ("slow reversals, then rest", motion_then_rest),
        "encoder_eccentricity": ("the travel at two speeds, in both directions", travel),
        "sensor_drift": ("slow reversals, then rest", motion_then_rest),
        "timing_jitter": ("a fast multisine", multisine),
        "gain_asymmetry": ("steps of four sizes", steps),
        "outliers": ("slow reversals, then rest", motion_then_rest),
    }
)
GENERAL = ("slow triangles at three rates", triangles)
"""Where nothing, or nothing with a name, is to be confirmed."""


@dataclass(frozen=True, eq=False)
class Experiment:
    """A command (samples,) in words, what it is expected to tell in nats, and what the axis answers, outputs
    (draws, samples)."""

    label: str
    u: FloatArray
    nats: float
    outputs: FloatArray


Outputs: TypeAlias = Callable[[FloatArray], FloatArray]
Worth: TypeAlias = Callable[[FloatArray], float]

SHRINKING = (1.0, 0.8, 0.6, 0.4, 0.25, 0.15, 0.08)


def confirming_experiments(
    answer: Sequence[str], stage: Stage, outputs: Outputs, worth: Worth
) -> list[Experiment]:
    """The play of the first label of the answer, then the others by their worth, those that the axis may do.

    `outputs` gives the angles (draws, samples) under a command, `worth` the nats that it is expected to tell.
    Raises InputError where the axis may do none.
    """
    named = PLAYS.get(answer[0], GENERAL) if answer else GENERAL
    rest = {label: play for label, play in [*PLAYS.values(), GENERAL] if label != named[0]}
    plays = [named, *rest.items()]
    found = [_fitted(label, play, stage, outputs, worth) for label, play in plays]
    if found[0] is None:
        raise InputError("stroke: the axis cannot play this experiment within it; widen --stroke")
    first, *others = (one for one in found if one is not None)
    return [first, *sorted(others, key=lambda one: -one.nats)]


def _fitted(label: str, play: Play, stage: Stage, outputs: Outputs, worth: Worth) -> Experiment | None:
    """The command within the limits, made smaller until the stroke holds it."""
    asked = np.concatenate(list(play(stage)))
    for factor in SHRINKING:
        u = kept_within(factor * asked, stage.limits, stage.sample_rate_hz)
        answered = outputs(u)
        if stage.limits.hold(answered):
            return Experiment(label, u, worth(u), answered)
    return None
