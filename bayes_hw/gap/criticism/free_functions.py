"""Score tests with basis functions of command, motion, position and time, at every block of an axis.

These free functions name no cause. Each is a sum of a few fixed shapes (linear B-splines over a signal, lags,
splines over time) that enters where its block does and reaches the output through the linear block, so that
what is missing can have any form. Where one of them still takes something of the residual, structure is left;
which of them takes most says where. Base tangents are projected off: what re-estimating the base could do
does not count.

Inflated variance of slow noise: it grows to hold whatever no effect of the catalogue does.

Held against noise that strong a cause explains little. With the cause told by a free function less noise is
needed: what both come to is a likelihood ratio, where `free_functions` has the score at full strength.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.noise.state_noise import StateNoise
from bayes_hw.gap.noise.whitener import Whitener
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.builder import SignalChain
from bayes_hw.gap.simulate.columns import linear_splines_over
from bayes_hw.gap.simulate.injection_point import InjectionPoint

SPLINES = 7
DETAILED_SPLINES = 25
"""Over the limited command: dead bands and steps of a converter are narrower than a knot of seven."""

DETAIL = "input in detail"
"""Where the function with that many enters; it stands apart, so that the others keep few shapes."""

READING = "sensor in detail"
"""Where the function of position enters that may go through many periods in a record, as errors do."""

MANY_SPLINES = 40
"""Over the position: ripple and eccentricity go through many periods in a record."""

GAIN = "gain over time"
"""The function by which the drive's gain may change in any way; as many knots a record as a free torque."""

LAGS = (1, 2, 4, 8, 16, 32)
TIME_KNOTS = 12
SMALLEST_DIRECTION = 1e-5
"""Of the largest singular value; a combination of shapes below it is left out."""

WEAK_DIRECTION = 0.03
"""Of a shape's own norm: combinations that reach the output less are shrunk in what is shown as taken."""


NO_MORE: Mapping[str, tuple[InjectionPoint, list[FloatArray]]] = MappingProxyType({})


@dataclass(frozen=True)
class Motion:
    """One record as the base model sees it: command, limited and delayed command, w and its speed.

    `seen` says where the encoder sees motion, outside the dead zone; everywhere if None. All (samples,).
    """

    command: FloatArray
    limited: FloatArray
    w: FloatArray
    speed: FloatArray
    seen: BoolArray | None = None

    def shown(self, responses: FloatArray) -> FloatArray:
        """What the encoder shows of changes of w (samples, n)."""
        return responses if self.seen is None else responses * self.seen[:, None]


@dataclass(frozen=True)
class FreeFunction:
    """What the free function of one block takes.

    `gain` is in log-likelihood, half of what is chi-squared of `shapes` degrees where nothing is left;
    `taken` the response (samples,) a record, output units.
    """

    block: str
    gain: float
    taken: tuple[FloatArray, ...]
    shapes: int

    @property
    def size(self) -> float:
        """Root mean square of what is taken, output units."""
        return float(np.sqrt(np.mean(np.concatenate(self.taken) ** 2)))


def motions(fit: Fit, commands: Sequence[FloatArray]) -> list[Motion]:
    """The motion of every record as a fit simulates it for `commands`."""
    rate, values = fit.hypothesis.scale.rate, fit.values
    chain = fit.hypothesis.chain(values)
    lower, upper, dead_zone = fit.hypothesis.settings(values, chain)[[S.LOWER, S.UPPER, S.DEAD_ZONE]]
    seen: list[BoolArray | None] = [None] * len(commands)
    if dead_zone > 0:
        seen = [np.abs(w) > dead_zone for w in fit.hypothesis.motion(values)[0]]
    found = []
    for u, w, seen_here in zip(commands, fit.simulated, seen, strict=True):
        delayed = np.concatenate([np.zeros(chain.delay_samples), u[: len(u) - chain.delay_samples]])
        found.append(Motion(delayed, np.clip(delayed, lower, upper), w, np.gradient(w) * rate, seen_here))
    return found


def linear_splines(signals: Sequence[FloatArray], count: int = SPLINES) -> list[FloatArray]:
    """Linear B-splines (samples, count) over a signal, knots at its quantiles in all records."""
    every = np.concatenate(list(signals))
    knots = np.unique(np.quantile(every, np.linspace(0.01, 0.99, count)))
    if len(knots) < 2 or knots[-1] - knots[0] <= 0:
        return [np.zeros((len(s), 0)) for s in signals]
    return [np.asarray(linear_splines_over(s, knots)) for s in signals]


def _signs(signals: Sequence[FloatArray]) -> list[FloatArray]:
    return [np.sign(s)[:, None] for s in signals]


def lagged(signal: FloatArray, lags: Sequence[int]) -> FloatArray:
    """A signal (samples,) some samples ago, less the signal now: (samples, lags)."""
    earlier = [np.concatenate([np.zeros(lag), signal[: len(signal) - lag]]) for lag in lags]
    return np.stack(earlier, axis=1) - signal[:, None]


def knots_in_time(lengths: Sequence[int]) -> list[FloatArray]:
    """Linear B-splines over time, those of every record its own."""
    found = []
    for record, length in enumerate(lengths):
        columns = np.zeros((length, TIME_KNOTS * len(lengths)))
        own = slice(record * TIME_KNOTS, (record + 1) * TIME_KNOTS)
        columns[:, own] = linear_splines_over(
            np.arange(float(length)), np.linspace(0, length - 1, TIME_KNOTS)
        )
        found.append(columns)
    return found


def _beside(*groups: Sequence[FloatArray]) -> list[FloatArray]:
    return [np.concatenate(columns, axis=1) for columns in zip(*groups, strict=True)]


def shapes_of_blocks(found: Sequence[Motion]) -> dict[str, tuple[InjectionPoint, list[FloatArray]]]:
    """For every block its door and shapes (samples, n) a record."""
    limited, speed, w = ([getattr(m, name) for m in found] for name in ("limited", "speed", "w"))
    command = [m.command for m in found]
    change = [np.gradient(c) for c in command]
    return {
        "input": (
            "command",
            _beside(linear_splines(command), linear_splines(change, 5), linear_splines(w), _signs(change)),
        ),
        "linear": ("command", [lagged(c, LAGS) for c in limited]),
        "drive": ("motor_torque", _beside(linear_splines(speed), _signs(speed), linear_splines(w))),
        "sensor": ("output", _beside(linear_splines(w), linear_splines(speed), _signs(speed))),
        "disturbance": ("load_torque", knots_in_time([len(m.w) for m in found])),
    }


def shapes_that_only_tell(found: Sequence[Motion]) -> dict[str, tuple[InjectionPoint, list[FloatArray]]]:
    """Where what is too flexible to say where a gap lies, but tells that something is left, enters, and its
    shapes (samples, n) a record: limited command and reading in detail, and a gain that changes over time."""
    return {
        DETAIL: ("command", linear_splines([m.limited for m in found], DETAILED_SPLINES)),
        READING: ("output", linear_splines([m.w for m in found], MANY_SPLINES)),
        GAIN: ("command", shapes_of_the_gain(found)),
    }


def shapes_of_the_gain(found: Sequence[Motion]) -> list[FloatArray]:
    """The limited command times splines over time (samples, n) a record: a gain that changes."""
    limited = [m.limited for m in found]
    knots = knots_in_time([len(c) for c in limited])
    return [c[:, None] * times for c, times in zip(limited, knots, strict=True)]


def responses_of_blocks(
    found: Sequence[Motion],
    chain: SignalChain,
    more: Mapping[str, tuple[InjectionPoint, list[FloatArray]]] = NO_MORE,
) -> dict[str, list[FloatArray]]:
    """What the encoder shows (samples, n), a record each, of the shapes of every block that has a door.

    `more` are doors and shapes as `shapes_of_blocks` gives them, by other names.
    """
    entries = {**shapes_of_blocks(found), **more}
    return {
        block: responses_of(found, chain, door, shapes)
        for block, (door, shapes) in entries.items()
        if chain.can_inject(door)
    }


def responses_of(
    found: Sequence[Motion], chain: SignalChain, door: InjectionPoint, shapes: Sequence[FloatArray]
) -> list[FloatArray]:
    """What the encoder shows (samples, n), a record each, of `shapes` (samples, n) that enter at a door."""
    responses = [chain.small_responses(door, s) for s in shapes]
    if door == "output":
        return responses
    return [m.shown(r) for m, r in zip(found, responses, strict=True)]


def free_functions(
    shown: Mapping[str, Sequence[FloatArray]],
    residuals: Sequence[FloatArray],
    tangents: Sequence[FloatArray],
    whitener: Whitener,
) -> list[FreeFunction]:
    """What the free function of every block takes of `residuals` (samples,), a record each.

    `shown` is what the encoder shows of the shapes, as `responses_of_blocks` gives it.
    """
    lengths = np.cumsum([len(e) for e in residuals])[:-1]
    plain = np.concatenate(list(tangents))
    basis, triangle = np.linalg.qr(np.concatenate([whitener.whiten(j, r) for r, j in enumerate(tangents)]))
    left = np.concatenate([whitener.whiten(e[:, None], r)[:, 0] for r, e in enumerate(residuals)])
    left = left - basis @ (basis.T @ left)
    results = []
    for block, responses in shown.items():
        columns = np.concatenate([whitener.whiten(c, r) for r, c in enumerate(responses)])
        scales = np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
        columns = columns / scales
        along = basis.T @ columns
        columns -= basis @ along
        amplitude, s, vt = directions(columns, left)
        gain = 0.5 * float(amplitude @ amplitude)
        weights = vt.T @ (amplitude * s / (s**2 + WEAK_DIRECTION**2))
        refitted = np.linalg.lstsq(triangle, along @ weights, rcond=None)[0]
        taken = np.concatenate(responses) @ (weights / scales) - plain @ refitted
        results.append(FreeFunction(block, gain, tuple(np.split(taken, lengths)), len(s)))
    return results


def directions(columns: FloatArray, left: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Of the singular value decomposition of `columns` (samples, n) what `left` (samples,) has along its left
    vectors (kept,), the values (kept,) and the right vectors (kept, n), those of small values left out; none
    where there are no columns.

    The left vectors are never made: a triangle has the same products with `left` as a last column beside it.
    """
    triangle = np.asarray(np.linalg.qr(np.concatenate([columns, left[:, None]], axis=1), mode="r"))
    u, s, vt = np.linalg.svd(triangle[:-1, :-1])
    kept = s > SMALLEST_DIRECTION * s.max(initial=0.0)
    return u[:, kept].T @ triangle[:-1, -1], s[kept], vt[kept]


STRENGTHS = (1.0, 0.1, 0.01)
"""Of the variance of the slow noise, from what it is on."""

AS_NOISE = "disturbance"
"""The block whose free function of time is what slow noise is itself: less noise beside it says nothing."""


def free_functions_with_free_variance(
    shown: Mapping[str, Sequence[FloatArray]],
    residuals: Sequence[FloatArray],
    fit: Fit,
    noise: StateNoise,
) -> list[FreeFunction]:
    """Every free function under the strength of the slow `noise` at which it and the noise explain
    `residuals` (samples,), a record each, best; its gain is that over the base at the strength that suits it.
    """
    best: dict[str, tuple[float, FreeFunction]] = {}
    alone = -np.inf
    for strength in STRENGTHS:
        weaker = noise.weaker(strength)
        base = weaker.fitted_to(residuals).log_likelihood + _gain_of_base(residuals, fit.jacobians, weaker)
        alone = max(alone, base)
        for function in free_functions(shown, residuals, fit.jacobians, weaker):
            total = base + function.gain
            known = best.get(function.block)
            if known is None or (total > known[0] and function.block != AS_NOISE):
                best[function.block] = (total, function)
    return [replace(function, gain=total - alone) for total, function in best.values()]


def _gain_of_base(
    residuals: Sequence[FloatArray], tangents: Sequence[FloatArray], noise: StateNoise
) -> float:
    """Log-likelihood that re-estimating the base would gain."""
    basis = np.linalg.qr(np.concatenate([noise.whiten(j, r) for r, j in enumerate(tangents)]))[0]
    taken = basis.T @ np.concatenate([noise.whiten(e[:, None], r)[:, 0] for r, e in enumerate(residuals)])
    return 0.5 * float(taken @ taken)
