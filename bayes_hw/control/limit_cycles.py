"""Limit cycles: where describing functions predict them, and whether the simulated loop has them.

Describing functions of the static blocks: what they do to the first harmonic of a sinusoid.

Gelb and Vander Velde, Multiple-Input Describing Functions and Nonlinear System Design, 1968, secs. 2.3, 6.2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray
from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import Crossings, phase_crossings
from bayes_hw.control.simulator import simulate_loop

BISECTIONS = 60


def saturation_gain(
    amplitude: FloatArray, lower: FloatArray, upper: FloatArray, bias: FloatArray | float = 0.0
) -> FloatArray:
    """First-harmonic gain of min(max(x, lower), upper) for x = bias + amplitude sin(angle).

        N = (g((upper - bias) / A) + g((bias - lower) / A)) / 2,   g(x) = 2/pi (asin x + x sqrt(1 - x^2))

    with x cut to [-1, 1]. Arrays broadcast.
    """
    above, below = (upper - bias) / amplitude, (bias - lower) / amplitude
    return (_odd_share(above) + _odd_share(below)) / 2


def saturation_mean(
    amplitude: FloatArray, lower: FloatArray, upper: FloatArray, bias: FloatArray | float
) -> FloatArray:
    """Mean of min(max(bias + amplitude sin(angle), lower), upper) over one period."""
    return (
        lower
        + amplitude * _mean_excess((lower - bias) / amplitude)
        - amplitude * _mean_excess((upper - bias) / amplitude)
    )


def balancing_bias(amplitude: FloatArray, lower: FloatArray, upper: FloatArray) -> FloatArray:
    """The bias for which `saturation_mean` is zero: an integrator behind the block allows no other.

    By bisection between the limits' midpoint for large amplitudes and zero for small ones.
    """
    low = np.broadcast_to(
        -amplitude - np.abs(lower), np.broadcast_shapes(np.shape(amplitude), np.shape(lower))
    )
    high = -low + np.abs(upper)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        positive = saturation_mean(amplitude, lower, upper, middle) > 0
        low, high = np.where(positive, low, middle), np.where(positive, middle, high)
    return np.asarray((low + high) / 2, dtype=np.float64)


def dead_zone_gain(amplitude: FloatArray, half_width: FloatArray) -> FloatArray:
    """First-harmonic gain of the dead zone (eq. 5 with unit gains) for amplitude sin(angle): 1 - g(delta /
    A).

    Zero amplitudes have gain one where the dead zone has no width, else zero.
    """
    safe = np.where(amplitude > 0, amplitude, 1.0)
    share = np.where(amplitude > 0, half_width / safe, np.where(half_width > 0, np.inf, 0.0))
    return 1 - _odd_share(share)


def _odd_share(x: FloatArray) -> FloatArray:
    """g(x) = 2/pi (asin x + x sqrt(1 - x^2)), x cut to [-1, 1]."""
    cut = np.clip(x, -1, 1)
    return np.asarray(2 / np.pi * (np.arcsin(cut) + cut * np.sqrt(1 - cut**2)), dtype=np.float64)


def _mean_excess(x: FloatArray) -> FloatArray:
    """Mean of max(sin(angle) - x, 0) over one period."""
    cut = np.clip(x, -1, 1)
    inside = (np.sqrt(1 - cut**2) - cut * np.arccos(cut)) / np.pi
    return np.asarray(np.where(x < -1, -x, np.where(x > 1, 0.0, inside)), dtype=np.float64)


Place: TypeAlias = Literal["away from zero", "around zero"]
"""Away from zero the dead zone has slope one and only the limits bend; around zero both blocks do."""

Matched: TypeAlias = Literal["frequency_hz", "position_amplitude"]

PLACES: tuple[Place, ...] = ("away from zero", "around zero")
AMPLITUDES = 400
SMALLEST_SHARE, LARGEST_SHARE = 1e-4, 1e4
"""Amplitudes of u that are tried, in units of the nearer limit."""

STABILITY_SLACK = 1e-3
"""The poles on the unit circle that are the oscillation itself are found this far off it at the most."""

KICK_SECONDS = 2.0
SETTLE_SECONDS = 120.0
SUSTAINED = 0.9
"""A quarter whose spread is at least this share of that of the quarter before has not died down."""

GROWING = 1.03
"""One whose spread is more than this multiple of that before has not reached its amplitude yet."""

ON_NYQUIST = 1e-9
MOVES = 1e-2
"""A command that swings by more than this share of the nearer limit is an oscillation."""


@dataclass(frozen=True, eq=False)
class PredictedCycles:
    """Oscillations that balance, one entry each: draw, frequency in Hz, amplitude of w
    (output units), and whether they are stable, so that the loop stays in them."""

    draws: int
    draw: IntArray
    frequency_hz: FloatArray
    position_amplitude: FloatArray
    stable: BoolArray

    @property
    def has_cycle(self) -> BoolArray:
        """Whether each draw (draws,) has a stable limit cycle."""
        found = np.zeros(self.draws, dtype=np.bool_)
        found[self.draw[self.stable]] = True
        return found


@dataclass(frozen=True, eq=False)
class SimulatedCycles:
    """What the simulated loop does at the end of a long run after a kick, each of shape (draws,).

    `sustained` says whether it still oscillates; `frequency_hz`, and `position_amplitude`, sqrt(2) times the
    standard deviation of w (output units), are NaN where it does not, the amplitude also where it grows
    still.
    """

    sustained: BoolArray
    frequency_hz: FloatArray
    position_amplitude: FloatArray


@dataclass(frozen=True, eq=False)
class CycleCheck:
    """Prediction and simulation of one controller at one place; the simulation is of the first draws."""

    place: Place
    predicted: PredictedCycles
    simulated: SimulatedCycles

    @property
    def agreement(self) -> float:
        """Share of the simulated draws for which both say the same."""
        checked = len(self.simulated.sustained)
        return float(np.mean(self.predicted.has_cycle[:checked] == self.simulated.sustained))

    def matched(self, name: Matched) -> tuple[FloatArray, FloatArray]:
        """Predicted and simulated values of the draws with one stable predicted cycle and a settled simulated
        one."""
        predicted, simulated = self.predicted, self.simulated
        stays = predicted.stable & (predicted.draw < len(simulated.sustained))
        draw, first, counts = np.unique(predicted.draw[stays], return_index=True, return_counts=True)
        kept = (counts == 1) & np.isfinite(simulated.position_amplitude[draw])
        return getattr(predicted, name)[stays][first[kept]], getattr(simulated, name)[draw[kept]]


def predict_cycles(loop: Loop, place: Place) -> PredictedCycles:
    """Solutions of 1 + N_f(A) N_n(B) L(f) = 0 for every draw, A the amplitude of u and B that of w.

    Both describing functions are real, so that oscillations lie where L is real and negative; A follows from
    N_f N_n = 1 / |L|. The bias of u is the one for which v has zero mean (`balancing_bias`). The limits are
    the tighter of the controller's and the axis's. At half the sample rate u alternates between two values
    and its gains are those of two values, not of a sinusoid. One is called stable when more amplitude means
    less gain where more gain destabilises, or the reverse (Loeb), and all other poles lie inside the unit
    circle.
    """
    axis, controller = loop.axis, loop.controller
    crossing = _beyond_one(phase_crossings(loop, loop.response(loop.frequency_hz)))
    c1, c2, c3 = axis.gains
    lower = np.maximum(axis.lower / c1, controller.speed_limit[0])[crossing.draw]
    upper = np.minimum(axis.upper / c1, controller.speed_limit[1])[crossing.draw]
    half_width = axis.half_width[crossing.draw] if place == "around zero" else np.zeros(len(crossing.draw))
    nearer = np.minimum(-lower, upper)
    amplitude = nearer[:, None] * np.geomspace(SMALLEST_SHARE, LARGEST_SHARE, AMPLITUDES)
    bias = balancing_bias(amplitude, lower[:, None], upper[:, None])
    saturation = saturation_gain(amplitude, lower[:, None], upper[:, None], bias)
    size = np.abs(crossing.response)
    plant = size / np.abs(controller.response(crossing.frequency_hz)) / max(c2, c3)
    position = amplitude * saturation * plant[:, None]
    gain = saturation * dead_zone_gain(position, half_width[:, None])
    alternating = crossing.frequency_hz >= loop.nyquist_hz * (1 - ON_NYQUIST)
    if np.any(alternating):
        sampled = np.minimum(1, nearer[:, None] / amplitude)
        swing = amplitude * sampled * plant[:, None]
        passed = np.maximum(1 - half_width[:, None] / swing, 0)
        position = np.where(alternating[:, None], swing, position)
        gain = np.where(alternating[:, None], sampled * passed, gain)
    excess = np.log(np.maximum(gain, 1e-300)) + np.log(size)[:, None]
    point, cell = np.nonzero((excess[:, :-1] > 0) != (excess[:, 1:] > 0))
    low, high = excess[point, cell], excess[point, cell + 1]
    share = low / (low - high)
    at_position = np.exp(
        np.log(position[point, cell]) * (1 - share) + np.log(position[point, cell + 1]) * share
    )
    draw = crossing.draw[point]
    return PredictedCycles(
        axis.count,
        draw,
        crossing.frequency_hz[point],
        at_position,
        _stays(loop, draw, 1 / size[point], falling=high < low),
    )


def simulate_cycles(axis: AxisDraws, controller: Controller, place: Place) -> SimulatedCycles:
    """Kick the whole nonlinear loop by a step that lasts KICK_SECONDS at full speed, wait, and look.

    Around zero the axis starts and ends in the middle of its dead zone; away from it far outside.
    """
    rate = axis.sample_rate_hz
    speed = np.abs(axis.velocity_gain()) * np.minimum(-axis.lower, axis.upper)
    kick = float(np.median(speed)) * KICK_SECONDS
    c2, c3 = axis.gains[1:]
    samples = round(SETTLE_SECONDS * rate)
    half_width = float(axis.half_width.max())
    home = 0.0 if place == "around zero" else 20 * (kick + half_width) * max(c2, c3)
    reference = np.full(samples, home)
    reference[1 : 1 + round(KICK_SECONDS * rate)] += kick
    start = np.where(home > 0, home / c2 + axis.half_width, 0.0)
    signals = simulate_loop(axis, controller, reference, initial_position=start)
    quarter = samples // 4
    last, before = signals.w[:, -quarter:], signals.w[:, -2 * quarter : -quarter]
    command = signals.u[:, -quarter:]
    nearer = np.minimum(-axis.lower, axis.upper) / axis.gains[0]
    spread, earlier = last.std(axis=1), before.std(axis=1)
    sustained = (spread > SUSTAINED * earlier) & (np.ptp(command, axis=1) > MOVES * nearer)
    return SimulatedCycles(
        np.asarray(sustained, dtype=np.bool_),
        np.where(sustained, _main_frequency(command, rate), np.nan),
        np.where(sustained & (spread < GROWING * earlier), np.sqrt(2) * spread, np.nan),
    )


def check_cycles(loop: Loop, simulated: int) -> tuple[CycleCheck, ...]:
    """Prediction for every draw and simulation of the first `simulated`, at both places."""
    few = loop.axis.take(np.arange(min(simulated, loop.axis.count)))
    return tuple(
        CycleCheck(place, predict_cycles(loop, place), simulate_cycles(few, loop.controller, place))
        for place in PLACES
    )


def _beyond_one(crossing: Crossings) -> Crossings:
    """The crossings with |L| > 1: neither describing function exceeds one."""
    kept = np.abs(crossing.response) > 1
    return Crossings(crossing.draw[kept], crossing.frequency_hz[kept], crossing.response[kept])


def _stays(loop: Loop, draw: IntArray, factor: FloatArray, falling: BoolArray) -> BoolArray:
    """Whether the loop with `factor` (points,) in front of L, on the verge of stability, has every pole
    inside but for the oscillation's own, and returns to that verge when its amplitude is disturbed."""
    if len(draw) == 0:
        return np.zeros(0, dtype=np.bool_)
    at = replace(loop, axis=loop.axis.take(draw))
    calm = at.spectral_radius(factor) < 1 + STABILITY_SLACK
    more, less = at.spectral_radius(factor * 1.01), at.spectral_radius(factor / 1.01)
    return np.asarray(calm & ((more > less) == falling), dtype=np.bool_)


def _main_frequency(signals: FloatArray, rate_hz: float) -> FloatArray:
    """Frequency in Hz of the largest line of each row, interpolated between lines."""
    centred = (signals - signals.mean(axis=1, keepdims=True)) * np.hanning(signals.shape[1])
    power = np.log(np.abs(np.fft.rfft(centred, axis=1)) + 1e-300)
    top = np.clip(np.argmax(power, axis=1), 1, power.shape[1] - 2)
    rows = np.arange(len(power))
    left, middle, right = power[rows, top - 1], power[rows, top], power[rows, top + 1]
    bend = left - 2 * middle + right
    shift = np.where(bend < 0, 0.5 * (left - right) / np.where(bend < 0, bend, -1), 0)
    return np.asarray((top + np.clip(shift, -0.5, 0.5)) * rate_hz / signals.shape[1], dtype=np.float64)
