"""Which block a cause enters at that nobody named: what functions rich enough for any cause there take.

They are held against the base's residuals beside a wandering discrepancy of unknown strength, a random walk
fitted with them: autoregressive noise in its place counts what is slow for little. How surprising a
function's gain is ranks the blocks. Stiffness and damping that change with the amplitude of the torsion are
among the functions, since no function of the motion now follows ringing that drifts out of phase.

A random walk also takes up what a torque does that wanders, most of a wind. Where the noise of such a torque
is likelier than the walk and leaves no function anything, the functions are held against it, and what is slow
is the disturbance's or the input's, whichever has the more surprising function of few shapes. Measured in
docs/decisions/0007-blocks-without-a-name.md.

Shapes of friction: functions of a speed and of the time since it turned, at the motor and at the load.

Where the gear twists, the motor turns at other times than the load does.

Shapes of a gear whose stiffness and damping change with the amplitude of its torsion.

Near one amplitude a spring that is not linear acts as a linear one of another stiffness and damping (harmonic
balance: Krylov and Bogoliubov, Introduction to Nonlinear Mechanics, 1943). These follow the ringing that such
a spring shifts in phase, where a function of the torsion now would not.

Shapes of an axis that remembers: what follows a limit that was left, or a reversal.

A function of the command or the motion now cannot show them: integrators that wind up behind a limiter,
hysteresis, torques that build up with the way since the axis turned. They are functions of the time since the
event, with the sign of the limit or of the motion, and of the command's own changes soon after a limit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.criticism.free_functions import (
    GAIN,
    MANY_SPLINES,
    Motion,
    free_functions,
    knots_in_time,
    lagged,
    linear_splines,
    motions,
    responses_of,
    shapes_of_blocks,
    shapes_of_the_gain,
)
from bayes_hw.gap.criticism.negative_log_p import chi_squared_negative_log_p
from bayes_hw.gap.effects.labels import BLOCKS, Block
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.slow_noise import wandering_background, wind
from bayes_hw.gap.noise.whitener import Whitener
from bayes_hw.gap.simulate.builder import SignalChain
from bayes_hw.gap.simulate.columns import linear_splines_over
from bayes_hw.gap.simulate.injection_point import InjectionPoint

AGES_S = (0.0, 0.15, 0.4, 1.0, 2.5)
"""Knots of the linear splines over the time since an event."""

SOON_S = (0.3, 1.5)
"""After a limit was left, within which changes of the command count."""

LAGS = (1, 3)
"""Samples over which these changes are taken."""

AT_REST = 0.02
"""Of the root mean square speed: below it the axis has not turned yet."""


def shapes_of_memories(
    found: Sequence[Motion], rate: float
) -> dict[str, tuple[InjectionPoint, list[FloatArray]]]:
    """For every kind of event the door and the shapes (samples, n), a record each, at `rate` samples a s."""
    return {
        "after a limit": ("command", [_after_limits(m, rate) for m in found]),
        "after a reversal": ("motor_torque", shapes_after_reversals(found, rate)),
    }


def shapes_after_reversals(found: Sequence[Motion], rate: float) -> list[FloatArray]:
    """Linear splines over the time since the motion turned, with its sign: shapes (samples, n) a record."""
    return [_after_reversals(m, rate) for m in found]


def _after_limits(motion: Motion, rate: float) -> FloatArray:
    beyond = np.sign(motion.command - motion.limited)
    left = np.concatenate([[False], (beyond[:-1] != 0) & (beyond[1:] == 0)])
    side, age = _since(left, np.concatenate([[0.0], beyond[:-1]]), rate)
    side = np.where(beyond == 0, side, 0.0)
    soon = np.stack([(side != 0) & (age < seconds) for seconds in SOON_S], axis=1)
    changes = [change[:, None] * soon for change in lagged(motion.limited, LAGS).T]
    return np.concatenate([_splines_of_age(age) * side[:, None], *changes], axis=1)


def _after_reversals(motion: Motion, rate: float) -> FloatArray:
    least = AT_REST * float(np.sqrt(np.mean(motion.speed**2)))
    moving = np.where(np.abs(motion.speed) > least, np.sign(motion.speed), 0.0)
    latest = _held(moving)
    turned = np.concatenate([[False], latest[1:] != latest[:-1]])
    direction, age = _since(turned, latest, rate)
    return _splines_of_age(age) * direction[:, None]


def _held(signs: FloatArray) -> FloatArray:
    """The last sign that was not zero (samples,), zero before the first."""
    at = np.maximum.accumulate(np.where(signs != 0, np.arange(len(signs)), 0))
    return np.asarray(signs[at])


def _since(events: BoolArray, signs: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """The sign at the latest of `events` (samples,), zero before the first, and the seconds since."""
    places = np.arange(len(events))
    latest = np.maximum.accumulate(np.where(events, places, -1))
    return np.where(latest >= 0, signs[latest], 0.0), (places - latest) / rate


def _splines_of_age(age: FloatArray) -> FloatArray:
    """Piecewise linear shapes (samples, knots) over the time since an event, the last zero at its knot."""
    return np.ascontiguousarray(linear_splines_over(age, np.array(AGES_S))[:, :-1])


MANY_LAGS = (1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64)
FLOOR = 10.0
"""Surprise that the sensor has at least: what no function of command, motion and time takes is a reading."""

FLOOR_OF_SCATTER = 40.0
"""The same where what is left is in the scatter of single samples."""

SPRING = "spring at every amplitude"
CONSTANT = "constant command"
SLOW_GAIN = "gain that drifts"
FRICTION = "friction at motor and load"

TORQUE_AHEAD = 30.0
"""Log-likelihood of a wandering torque above a wandering reading from which the residual is the former."""

ALL_TAKEN = 12.0
"""Surprise below which a wandering torque leaves a function nothing."""

HIDDEN_BY_A_WALK = 1.2
"""How much more surprising a torque over time is that a walk of the reading takes a part of."""

FLOOR_OF_TORQUE = 15.0
"""Surprise that the disturbance has at least where a wandering torque takes everything."""

STEADY_AT_THE_INPUT = (CONSTANT, SLOW_GAIN)
"""What has so few shapes that a torque which wanders does not pass for it."""

Shapes: TypeAlias = Mapping[str, Sequence[tuple[InjectionPoint, Sequence[FloatArray]]]]

BLOCK_OF: Mapping[str, Block] = MappingProxyType(
    {
        "command": "input",
        CONSTANT: "input",
        GAIN: "input",
        SLOW_GAIN: "input",
        "limits over position": "input",
        "limits over time": "input",
        "lags": "linear",
        SPRING: "linear",
        "motion at motor and load": "drive",
        FRICTION: "drive",
        "position at the motor": "drive",
        "position at the load": "drive",
        "torque over time": "disturbance",
        "reading": "sensor",
        "position at the encoder": "sensor",
    }
)


def shapes_for_any_cause(found: Sequence[Motion], chain: SignalChain, scale: AxisScale) -> Shapes:
    """For every function of BLOCK_OF the doors it enters at, with its shapes (samples, n) a record."""
    plain = shapes_of_blocks(found)
    door, moving = plain["drive"]
    turned = shapes_after_reversals(found, scale.rate)
    remembering = [np.concatenate(both, axis=1) for both in zip(moving, turned, strict=True)]
    places = linear_splines([m.w for m in found], MANY_SPLINES)
    return {
        "command": [plain["input"]],
        CONSTANT: [("command", [np.ones((len(m.w), 1)) for m in found])],
        GAIN: [("command", shapes_of_the_gain(found))],
        SLOW_GAIN: [("command", [_drifting(m.limited) for m in found])],
        "limits over position": [("command", _while_limited(found, linear_splines([m.w for m in found])))],
        "limits over time": [("command", _while_limited(found, knots_in_time([len(m.w) for m in found])))],
        "lags": [("command", [lagged(m.limited, MANY_LAGS) for m in found])],
        SPRING: [("gear_torque", shapes_of_springs(found, chain, scale))],
        "motion at motor and load": [(door, remembering), ("load_torque", remembering)],
        FRICTION: [
            ("motor_torque", shapes_of_friction(motions_of_the_motor(found, chain, scale), scale.rate)),
            ("load_torque", shapes_of_friction(found, scale.rate)),
        ],
        "position at the motor": [("motor_torque", places)],
        "position at the load": [("load_torque", places)],
        "torque over time": [plain["disturbance"]],
        "reading": [plain["sensor"]],
        "position at the encoder": [("output", places)],
    }


def _drifting(limited: FloatArray) -> FloatArray:
    """Limited command (samples,) times time and its square, from -1 to 1: (samples, 2)."""
    time = np.linspace(-1, 1, len(limited))
    return limited[:, None] * np.stack([time, time**2], axis=1)


def _while_limited(found: Sequence[Motion], shapes: Sequence[FloatArray]) -> list[FloatArray]:
    """`shapes` (samples, n), a record each, of the sign of the limit where a command is beyond one."""
    beyond = [np.sign(m.command - m.limited)[:, None] for m in found]
    return [sign * columns for sign, columns in zip(beyond, shapes, strict=True)]


def _shown(chain: SignalChain, found: Sequence[Motion], shapes: Shapes) -> dict[str, list[FloatArray]]:
    """What the encoder shows (samples, n), a record each, of every function that has a door and shapes."""
    shown = {}
    for name, entries in shapes.items():
        present = [(door, own) for door, own in entries if chain.can_inject(door) and own[0].shape[1]]
        parts = [responses_of(found, chain, door, own) for door, own in present]
        if parts:
            shown[name] = [np.concatenate(records, axis=1) for records in zip(*parts, strict=True)]
    return shown


def block_negative_log_p(fit: Fit, inputs: Sequence[FloatArray]) -> dict[str, float]:
    """How surprising, in nats, what the best function of every block takes of the residuals of `fit` is.

    `inputs` are the commands (samples,), a record each. Zero for a block that has no door. Where a torque
    that wanders is likelier than a reading that does, and leaves nothing, it is the disturbance, unless a
    steady change of the command takes more: rates that add up pass for such a torque.
    """
    moved = motions(fit, inputs)
    chain = fit.hypothesis.chain(fit.values)
    shown = _shown(chain, moved, shapes_for_any_cause(moved, chain, fit.hypothesis.scale))
    walk, torque = wandering_background(fit), wind(fit)
    by_walk = _negative_log_p(shown, fit, walk)
    found = _best_of_blocks(by_walk)
    if torque is None or torque.log_likelihood < walk.log_likelihood + TORQUE_AHEAD:
        return found
    beside_torque = _best_of_blocks(_negative_log_p(shown, fit, torque.whitener))
    if max(beside_torque.values()) >= ALL_TAKEN:
        return found
    steady = max(by_walk.get(name, 0.0) for name in STEADY_AT_THE_INPUT)
    return {
        **beside_torque,
        "input": max(beside_torque["input"], steady),
        "disturbance": max(HIDDEN_BY_A_WALK * found["disturbance"], FLOOR_OF_TORQUE),
    }


def _negative_log_p(shown: Mapping[str, Sequence[FloatArray]], fit: Fit, noise: Whitener) -> dict[str, float]:
    """Of every function in nats, beside `noise`."""
    functions = free_functions(shown, fit.residuals, fit.jacobians, noise)
    return {f.block: chi_squared_negative_log_p(2 * f.gain, f.shapes) for f in functions}


def _best_of_blocks(negative_log_p: Mapping[str, float]) -> dict[str, float]:
    found: dict[str, float] = dict.fromkeys(BLOCKS, 0.0)
    for name, value in negative_log_p.items():
        found[BLOCK_OF[name]] = max(found[BLOCK_OF[name]], value)
    return found


def with_floor(negative_log_p: Mapping[str, float], scattered: bool) -> dict[str, float]:
    """`block_negative_log_p` with the least that the sensor has.

    `scattered` says that what is left of the best explanation is in the scatter of single samples.
    """
    floor = FLOOR_OF_SCATTER if scattered else FLOOR
    return {**negative_log_p, "sensor": max(negative_log_p["sensor"], floor)}


def motions_of_the_motor(found: Sequence[Motion], chain: SignalChain, scale: AxisScale) -> list[Motion]:
    """The same with the motor's angle and speed for the load's: ahead of it by the torsion of the gear.

    The load's own where the drive train is not known.
    """
    moved = []
    for motion in found:
        torsion = chain.torsions(motion.limited[:, None])[:, 0]
        speed = motion.speed + np.gradient(torsion) * scale.rate
        moved.append(replace(motion, w=motion.w + torsion, speed=speed))
    return moved


def shapes_of_friction(found: Sequence[Motion], rate: float) -> list[FloatArray]:
    """Shapes (samples, n) a record: the sign of the speed, splines over it, and what follows a reversal."""
    speeds = linear_splines([m.speed for m in found])
    turned = shapes_after_reversals(found, rate)
    signs = [np.sign(m.speed)[:, None] for m in found]
    return [np.concatenate(all_three, axis=1) for all_three in zip(signs, speeds, turned, strict=True)]


AMPLITUDES = 3
"""Linear splines over the amplitude."""


def shapes_of_springs(found: Sequence[Motion], chain: SignalChain, scale: AxisScale) -> list[FloatArray]:
    """Torsion and its rate at every amplitude, shapes (samples, 2 AMPLITUDES) a record, of a gear torque.

    The amplitude is the root mean square over the last period of the first mode. No shapes (samples, 0)
    where the drive train is not known.
    """
    nothing = [np.zeros((len(m.w), 0)) for m in found]
    torsion = [chain.torsions(m.limited[:, None])[:, 0] for m in found]
    if not any(np.any(phi) for phi in torsion):
        return nothing
    period = max(round(scale.rate / scale.first_mode_hz), 1)
    amplitudes = linear_splines([_recent_rms(phi, period) for phi in torsion], AMPLITUDES)
    return [
        np.concatenate([phi[:, None] * own, np.gradient(phi)[:, None] * scale.rate * own], axis=1)
        for phi, own in zip(torsion, amplitudes, strict=True)
    ]


def _recent_rms(signal: FloatArray, period: int) -> FloatArray:
    """Root mean square (samples,) of a signal over the last `period` samples, zeros before the first."""
    sums = np.cumsum(np.concatenate([np.zeros(period), signal**2]))
    return np.sqrt(np.maximum(sums[period:] - sums[:-period], 0.0) / period)
