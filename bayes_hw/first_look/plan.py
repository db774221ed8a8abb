"""What a good record of an axis is, as a command to play within what the axis may do.

Rest, a sweep of small and one of full amplitude, slow triangles of the angle, steps, rest: the sweeps show
the response and, between their amplitudes, the limits; triangles about the start show dead zone, play and
friction; steps show the delay. The hold-out is a random-phase multisine: another kind of command, so that a
model that has learnt the sweeps by heart is found out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.model.excitation import random_phase_multisine

REST_S = 5.0
SMALL = 0.3
SLOW = 0.06
"""Command of the triangles, in units of the largest."""

REVERSALS = 10
STEP_HOLD_S = 4.0
STEP_LEVELS = (0.25, 0.0, -0.25, 0.0, 1.0, 0.0, -1.0, 0.0)
STROKE_SHARE = 0.3
"""Of the stroke, the most that one swing takes."""

FADE_S = 2.0
SAMPLES_A_CYCLE = 4.0
"""Fewest samples in a cycle of the highest frequency."""

LEAST_SWEEP_S = 30.0

PARTS = (
    ("rest", "noise of the encoder, drift, and that the start is at rest"),
    ("small sweep", "the response where no limit is met"),
    ("rest", "how the axis settles"),
    ("full sweep", "the limits, and modes that a small command does not move"),
    ("rest", "how the axis settles"),
    ("slow triangles", "dead zone, play and friction, at each reversal"),
    ("rest", "creep and drift after motion"),
    ("steps", "delay, rise and settling time, limits on both sides"),
    ("rest", "noise of the encoder, and drift over the record"),
)
"""Names and what they show, of the parts of the training command in the order of `plan`."""


@dataclass(frozen=True)
class AxisLimits:
    """Largest command and its largest change in a second (command units), angle from `low` to `high` about
    the start, and the speed of the axis for a command of one (output units).
    """

    velocity: float
    acceleration: float
    low: float
    high: float
    gain: float = 1.0

    @property
    def swing(self) -> float:
        """The largest amplitude of the angle about the start."""
        return STROKE_SHARE * min(-self.low, self.high)


@dataclass(frozen=True)
class Part:
    """A stretch of the training command in s, and what it shows, in words."""

    name: str
    start_s: float
    end_s: float
    shows: str


@dataclass(frozen=True, eq=False)
class Plan:
    """Commands (samples,) at `sample_rate_hz`: one to play twice, for training, and one to hold out; the
    parts of the first, which follow each other without a gap; reasons in words.
    """

    sample_rate_hz: float
    highest_hz: float
    train: FloatArray
    holdout: FloatArray
    parts: tuple[Part, ...]
    reasons: tuple[str, ...]


def plan(
    limits: AxisLimits,
    rng: np.random.Generator,
    *,
    sample_rate_hz: float,
    highest_hz: float,
    duration_s: float,
) -> Plan:
    """Raises InputError where limits, rate and length leave no such record."""
    _check(limits, sample_rate_hz, highest_hz, duration_s)
    rest = np.zeros(round(REST_S * sample_rate_hz))
    lowest = max(SMALL * limits.velocity * limits.gain / (2 * np.pi * limits.swing), 4 / duration_s, 0.01)
    triangles = _triangles(limits, sample_rate_hz, duration_s)
    steps = _steps(limits, sample_rate_hz)
    left = duration_s - (len(triangles) + len(steps) + 5 * len(rest)) / sample_rate_hz
    if left < 2 * LEAST_SWEEP_S:
        raise InputError(
            f"--duration {duration_s:g}: the other parts leave {max(left, 0):.0f} s for two sweeps; "
            f"give {duration_s + 2 * LEAST_SWEEP_S - left:.0f} s or more"
        )
    sweeps = [
        _sweep(limits, sample_rate_hz, left / 2, lowest, highest_hz, size * limits.velocity)
        for size in (SMALL, 1.0)
    ]
    pieces = (rest, sweeps[0], rest, sweeps[1], rest, triangles, rest, steps, rest)
    train = np.concatenate(pieces)
    holdout = np.concatenate(
        [rest, _multisine(limits, rng, sample_rate_hz, duration_s / 2, lowest, highest_hz), rest]
    )
    for command in (train, holdout):
        _within(limits, command, sample_rate_hz)
    return Plan(
        sample_rate_hz,
        highest_hz,
        train,
        holdout,
        _parts(pieces, sample_rate_hz),
        _reasons(limits, sample_rate_hz, lowest, highest_hz, duration_s, left / 2),
    )


def _parts(pieces: Sequence[FloatArray], rate: float) -> tuple[Part, ...]:
    ends = np.cumsum([len(piece) for piece in pieces]) / rate
    starts = np.concatenate([[0.0], ends[:-1]])
    return tuple(
        Part(name, float(start), float(end), shows)
        for (name, shows), start, end in zip(PARTS, starts, ends, strict=True)
    )


def angle(command: FloatArray, limits: AxisLimits, sample_rate_hz: float) -> FloatArray:
    """Where an ideal axis goes."""
    return limits.gain * np.cumsum(command) / sample_rate_hz


def _check(limits: AxisLimits, sample_rate_hz: float, highest_hz: float, duration_s: float) -> None:
    for option, value in (
        ("--velocity", limits.velocity),
        ("--acceleration", limits.acceleration),
        ("--gain", limits.gain),
        ("--rate", sample_rate_hz),
        ("--highest", highest_hz),
        ("--duration", duration_s),
    ):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{option} {value:g}: must be positive")
    if not limits.low < 0 < limits.high:
        raise InputError(
            f"--stroke {limits.low:g} {limits.high:g}: must enclose zero, where the axis stands at the start"
        )
    if highest_hz * SAMPLES_A_CYCLE > sample_rate_hz:
        raise InputError(
            f"--highest {highest_hz:g}: needs {SAMPLES_A_CYCLE:g} samples a cycle; "
            f"record at {SAMPLES_A_CYCLE * highest_hz:g} Hz or more, or go to "
            f"{sample_rate_hz / SAMPLES_A_CYCLE:g} Hz"
        )


def _sweep(
    limits: AxisLimits, rate: float, duration_s: float, lowest: float, highest: float, amplitude: float
) -> FloatArray:
    """A sweep whose frequency grows exponentially; smaller where acceleration or stroke would be passed."""
    t = np.arange(round(duration_s * rate)) / rate
    growth = np.log(highest / lowest) / duration_s
    frequency = lowest * np.exp(growth * t)
    phase = 2 * np.pi * (frequency - lowest) / growth
    w = 2 * np.pi * frequency
    size = np.minimum(amplitude, np.minimum(0.9 * limits.acceleration / w, w * limits.swing / limits.gain))
    ends = np.minimum(1.0, np.minimum(t, t[-1] - t) / FADE_S)
    command = size * ends * np.cos(phase)
    command = command - ends * float(command.sum() / max(ends.sum(), 1.0))
    return _fitted(command, limits, rate)


def _triangles(limits: AxisLimits, rate: float, duration_s: float) -> FloatArray:
    """A slow command to one side and the other, so that the angle is a triangle about the start."""
    level = SLOW * limits.velocity
    half_s = min(2 * limits.swing / (limits.gain * level), 0.3 * duration_s / REVERSALS)
    half = max(round(half_s * rate), 2)
    signs = np.repeat((-1.0) ** np.arange(REVERSALS), half)
    turn = np.ones(half // 2)
    signs = np.concatenate([turn, -signs, -turn, np.zeros(_ramp(level, limits, rate))])
    return _ramped(level * signs, limits, rate)


def _steps(limits: AxisLimits, rate: float) -> FloatArray:
    hold = max(round(STEP_HOLD_S * rate), _ramp(limits.velocity, limits, rate))
    size = min(limits.velocity, limits.swing / (limits.gain * STEP_HOLD_S * max(STEP_LEVELS)))
    return _ramped(size * np.repeat(np.array(STEP_LEVELS), hold), limits, rate)


def _ramp(change: float, limits: AxisLimits, rate: float) -> int:
    """Samples that a change of the command takes."""
    return int(np.ceil(change * rate / (0.99 * limits.acceleration))) + 1


def _ramped(command: FloatArray, limits: AxisLimits, rate: float) -> FloatArray:
    """The command with no change faster than the acceleration allows."""
    most, value = 0.99 * limits.acceleration / rate, 0.0
    ramped = np.empty(len(command))
    for k, wanted in enumerate(command.tolist()):
        value += min(max(wanted - value, -most), most)
        ramped[k] = value
    return ramped


def _multisine(
    limits: AxisLimits,
    rng: np.random.Generator,
    rate: float,
    duration_s: float,
    lowest: float,
    highest: float,
) -> FloatArray:
    corner = min(max(0.5 * limits.acceleration / (2 * np.pi * limits.velocity), lowest), highest)
    bands = [(lowest, corner, 1.0), *_octaves(corner, highest)]
    command = np.sum(
        [
            size * random_phase_multisine(rng, rate, duration_s, 1.0, low, high)
            for low, high, size in bands
            if high * duration_s >= np.floor(low * duration_s) + 1
        ],
        axis=0,
    )
    t = np.arange(len(command)) / rate
    ends = np.minimum(1.0, np.minimum(t, t[-1] - t) / FADE_S)
    command = command * ends
    command -= ends * command.sum() / ends.sum()
    return _fitted(1e6 * command, limits, rate)


def _octaves(corner: float, highest: float) -> list[tuple[float, float, float]]:
    """Bands from the corner up, each of half the size of the one before, as the acceleration asks."""
    edges = [corner * 2.0**k for k in range(int(np.ceil(np.log2(highest / corner))))] + [highest]
    return [(low, high, 0.5**k) for k, (low, high) in enumerate(pairwise(edges))]


def _fitted(command: FloatArray, limits: AxisLimits, rate: float) -> FloatArray:
    """The command, made smaller until it stays within velocity, acceleration and twice the swing."""
    moved = np.abs(angle(command, limits, rate)).max()
    change = np.abs(np.diff(command)).max() * rate
    size = min(
        1.0,
        limits.velocity / np.abs(command).max(),
        0.98 * limits.acceleration / change,
        2 * limits.swing / moved,
    )
    return np.asarray(size * command)


def _within(limits: AxisLimits, command: FloatArray, rate: float) -> None:
    moved = angle(command, limits, rate)
    if (
        np.abs(command).max() > limits.velocity * (1 + 1e-9)
        or np.abs(np.diff(command)).max() * rate > limits.acceleration * (1 + 1e-9)
        or moved.min() < limits.low
        or moved.max() > limits.high
    ):
        raise InputError(
            "--velocity, --acceleration, --stroke: no command of this kind stays within them; "
            "give a longer stroke, or a smaller --velocity"
        )


def _reasons(
    limits: AxisLimits, rate: float, lowest: float, highest: float, duration_s: float, sweep_s: float
) -> tuple[str, ...]:
    return (
        f"Rate: {rate:g} Hz, {rate / highest:.0f} samples in a cycle of the highest, {highest:g} Hz.",
        f"Length: {duration_s:.0f} s; the bands of a response narrow with its square root.",
        f"Sweeps: {lowest:.2g} to {highest:g} Hz in {sweep_s:.0f} s, at {SMALL * limits.velocity:.3g} and at "
        f"{limits.velocity:.3g}: where the two responses differ, a limit or a dead zone is met.",
        f"Slow triangles: {REVERSALS} reversals at {SLOW * limits.velocity:.2g}, for dead zone and play.",
        "Steps, each held, for the delay and the settling time.",
        f"Rest: {REST_S:g} s at both ends and between the parts, for noise, drift and the start at rest.",
        "Repeat: play it twice; what differs is noise, what does not is the axis.",
        "Hold-out: a multisine that no fit has seen, for the honest score.",
        "Largest command: above the limits that the drive is thought to have, or they stay unknown.",
    )
