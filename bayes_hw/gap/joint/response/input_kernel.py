"""Compiled: the command behind limits of rate and size, curves, drifts and a bias, and its tangents.

`inputs` are the numbers of the effects as `effect_codes` has them and `columns.inputs` the column of each, -1
where there is none. Tangents of v are kept for those columns that move it at all.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.compiled import compiled, compiled_inside, compiled_loop, pasted
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.motion_kernel import RAMPS
from bayes_hw.gap.joint.response.ramp_kernel import ramped, ramped_within
from bayes_hw.model.lanes import LANES

EARLY, LATE, AT_ONCE = range(3)
"""Rows of `Motion.ramps`."""


class InputEffects(NamedTuple):
    """Which effects stand between the command and G; `limits_move` where limits depend on the angle."""

    limits_move: bool
    early_ramp: bool
    late_ramp: bool
    at_once: bool
    curve: bool
    change: bool


class Factor(NamedTuple):
    """What limits are multiplied by at the angle `ahead` that they look at, `lead` steps on at the last one's
    `speed`: its wave there, sine, cosine and `turned`, the derivative by their argument; and its slope."""

    value: float
    slope: float
    sine: float
    cosine: float
    turned: float
    ahead: float
    speed: float
    lead: float


class CommandTangents(NamedTuple):
    """What a command takes of `motion_kernel.Tangents`."""

    blocks: int
    states: FloatArray
    each_w: FloatArray
    each_v: FloatArray
    ramps: FloatArray
    moving: IntArray


@compiled_inside
def input_effects(inputs, of_inputs):  # type: ignore[no-untyped-def]
    """Those that do something, or whose tangents are asked for."""
    moves = of_inputs[K.LIMIT_SINE] >= 0 or inputs[K.LIMIT_SINE] != 0.0 or inputs[K.LIMIT_COSINE] != 0.0
    return InputEffects(
        moves or of_inputs[K.LIMIT_SLOPE] >= 0 or inputs[K.LIMIT_SLOPE] != 0.0,
        of_inputs[K.EARLY_RATE] >= 0 or inputs[K.EARLY_RATE] > 0.0,
        of_inputs[K.LATE_RATE] >= 0 or inputs[K.LATE_RATE] > 0.0,
        of_inputs[K.HELD] >= 0 or inputs[K.HELD] != 0.0,
        of_inputs[K.EVEN_CURVE] >= 0 or inputs[K.EVEN_CURVE] != 0.0 or inputs[K.ODD_CURVE] != 0.0,
        of_inputs[K.CHANGE] >= 0 or inputs[K.CHANGE] != 0.0,
    )


@pasted
def behind_limits(  # type: ignore[no-untyped-def]
    asked, begins, w, before, static, inputs, steps, effects, of_static, of_inputs, ramps, tangents
):
    """The command `asked` over a step behind limits of rate and size, at w, a step after `before`; `begins`
    says whether a sample begins with this step."""
    for c in tangents.moving:
        tangents.each_v[c] = 0.0
    factor = limits_factor(effects.limits_move, inputs, w, before, steps)
    lowest, highest = static[0] * factor.value, static[1] * factor.value
    if effects.early_ramp:
        v, by_lowest, by_highest = ramped_and_limited(
            asked, lowest, highest, steps, begins, inputs, effects, of_inputs, ramps, tangents
        )
    else:
        v, by_lowest, by_highest = clipped(asked, lowest, highest)
    if by_lowest != 0.0 or by_highest != 0.0:
        add_tangents_of_limits(
            by_lowest, by_highest, factor, steps, static, effects, of_static, of_inputs, tangents
        )
    if effects.late_ramp:
        v = ramped_behind(v, steps, begins, inputs, effects, of_inputs, ramps, tangents)
    return v


@pasted
def limits_factor(limits_move, inputs, w, before, steps):  # type: ignore[no-untyped-def]
    """`Factor` at w, a step of 1 / `steps` samples after `before`."""
    if not limits_move:
        return Factor(1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    wave, lead, speed = inputs[K.LIMIT_WAVENUMBER], inputs[K.LIMIT_LEAD] * steps, w - before
    ahead = w + lead * speed
    s, co = math.sin(wave * ahead), math.cos(wave * ahead)
    value = 1.0 + (inputs[K.LIMIT_SINE] * s + inputs[K.LIMIT_COSINE] * co + inputs[K.LIMIT_SLOPE] * ahead)
    turned = inputs[K.LIMIT_SINE] * co - inputs[K.LIMIT_COSINE] * s
    return Factor(value, wave * turned + inputs[K.LIMIT_SLOPE], s, co, turned, ahead, speed, lead)


@pasted
def clipped(asked, lowest, highest):  # type: ignore[no-untyped-def]
    """A command within limits, and its derivatives by both."""
    if asked < lowest:
        return lowest, 1.0, 0.0
    if asked > highest:
        return highest, 0.0, 1.0
    return asked, 0.0, 0.0


@pasted
def ramped_and_limited(  # type: ignore[no-untyped-def]
    asked, lowest, highest, steps, begins, inputs, effects, of_inputs, ramps, tangents
):
    """The mean over a step of a ramp towards the command, limited behind, and its derivatives by both limits;
    its other tangents are written."""
    d_ramps, d_v = tangents.ramps, tangents.each_v
    limited, by_lowest, by_highest, by_rate, by_before, end, end_by_rate, end_by_before = ramped_within(
        asked, ramps[EARLY], inputs[K.EARLY_RATE] * steps, lowest, highest
    )
    rate = of_inputs[K.EARLY_RATE]
    if effects.at_once and begins:
        _, ramps[AT_ONCE], _, _, once_by_rate, once_by_before = ramped(
            asked, ramps[EARLY], inputs[K.EARLY_RATE]
        )
        for c in tangents.moving:
            d_ramps[AT_ONCE, c] = once_by_before * d_ramps[EARLY, c]
        if rate >= 0:
            d_ramps[AT_ONCE, rate] += once_by_rate
    ramps[EARLY] = end
    for c in tangents.moving:
        d_v[c] = by_before * d_ramps[EARLY, c]
        d_ramps[EARLY, c] *= end_by_before
    if rate >= 0:
        d_v[rate] += by_rate * steps
        d_ramps[EARLY, rate] += end_by_rate * steps
    if effects.at_once:
        share, held = inputs[K.HELD], ramps[AT_ONCE]
        stepped = min(max(held, lowest), highest)
        free = share if stepped == held else 0.0
        for c in tangents.moving:
            d_v[c] = (1.0 - share) * d_v[c] + free * d_ramps[AT_ONCE, c]
        if of_inputs[K.HELD] >= 0:
            d_v[of_inputs[K.HELD]] += stepped - limited
        by_lowest = (1.0 - share) * by_lowest + (share if held < lowest else 0.0)
        by_highest = (1.0 - share) * by_highest + (share if held > highest else 0.0)
        limited += share * (stepped - limited)
    return limited, by_lowest, by_highest


@pasted
def add_tangents_of_limits(  # type: ignore[no-untyped-def]
    by_lowest, by_highest, factor, steps, static, effects, of_static, of_inputs, tangents
):
    """Added: what a command that depends so on both limits has from their tangents; the last state of every
    block is w a step before."""
    d_v, by_factor = tangents.each_v, 0.0
    if by_lowest != 0.0:
        by_factor += by_lowest * static[0]
        if of_static[0] >= 0:
            d_v[of_static[0]] += by_lowest * factor.value
    if by_highest != 0.0:
        by_factor += by_highest * static[1]
        if of_static[1] >= 0:
            d_v[of_static[1]] += by_highest * factor.value
    if effects.limits_move:
        by_ahead, lead = by_factor * factor.slope, factor.lead
        states = len(tangents.states) // max(tangents.blocks, 1)
        for c in tangents.moving:
            d_before = tangents.states[c // LANES * states + states - 1, c % LANES]
            d_v[c] += by_ahead * ((1.0 + lead) * tangents.each_w[c] - lead * d_before)
        if of_inputs[K.LIMIT_SINE] >= 0:
            d_v[of_inputs[K.LIMIT_SINE]] += by_factor * factor.sine
            d_v[of_inputs[K.LIMIT_COSINE]] += by_factor * factor.cosine
            d_v[of_inputs[K.LIMIT_LEAD]] += by_ahead * steps * factor.speed
            d_v[of_inputs[K.LIMIT_WAVENUMBER]] += by_factor * factor.ahead * factor.turned
        if of_inputs[K.LIMIT_SLOPE] >= 0:
            d_v[of_inputs[K.LIMIT_SLOPE]] += by_factor * factor.ahead


@pasted
def ramped_behind(limited, steps, begins, inputs, effects, of_inputs, ramps, tangents):  # type: ignore[no-untyped-def]
    """The mean over a step of a ramp towards the limited command, with its tangents."""
    d_ramps, d_v = tangents.ramps, tangents.each_v
    v, end, by_rate, by_before, end_by_rate, end_by_before = ramped(
        limited, ramps[LATE], inputs[K.LATE_RATE] * steps
    )
    rate = of_inputs[K.LATE_RATE]
    if effects.at_once and begins:
        _, ramps[AT_ONCE], _, _, once_by_rate, once_by_before = ramped(
            limited, ramps[LATE], inputs[K.LATE_RATE]
        )
        for c in tangents.moving:
            d_ramps[AT_ONCE, c] = (1.0 - once_by_before) * d_v[c] + once_by_before * d_ramps[LATE, c]
        if rate >= 0:
            d_ramps[AT_ONCE, rate] += once_by_rate
    for c in tangents.moving:
        to_target = d_v[c]
        d_v[c] = (1.0 - by_before) * to_target + by_before * d_ramps[LATE, c]
        d_ramps[LATE, c] = (1.0 - end_by_before) * to_target + end_by_before * d_ramps[LATE, c]
    if rate >= 0:
        d_v[rate] += by_rate * steps
        d_ramps[LATE, rate] += end_by_rate * steps
    ramps[LATE] = end
    if effects.at_once:
        share, held = inputs[K.HELD], ramps[AT_ONCE]
        for c in tangents.moving:
            d_v[c] += share * (d_ramps[AT_ONCE, c] - d_v[c])
        if of_inputs[K.HELD] >= 0:
            d_v[of_inputs[K.HELD]] += held - v
        v += share * (held - v)
    return v


@pasted
def behind_gains(v, k, inputs, effects, of_inputs, tangents):  # type: ignore[no-untyped-def]
    """The limited command behind a curve, a drift and a bias, `k` samples after the beginning."""
    d_v = tangents.each_v
    if effects.curve:
        even, odd, size = inputs[K.EVEN_CURVE], inputs[K.ODD_CURVE], abs(v)
        bent = 1.0 + 2 * odd * size + (even if v > 0 else -even)
        for c in tangents.moving:
            d_v[c] *= bent
        if of_inputs[K.EVEN_CURVE] >= 0:
            d_v[of_inputs[K.EVEN_CURVE]] += size
            d_v[of_inputs[K.ODD_CURVE]] += size * v
        v += even * size + odd * size * v
    if effects.change:
        gain, time = inputs[K.CHANGE], inputs[K.WARMING]
        decay = math.exp(-k / time)
        warmed = 1.0 + gain * (1.0 - decay)
        for c in tangents.moving:
            d_v[c] *= warmed
        if of_inputs[K.CHANGE] >= 0:
            d_v[of_inputs[K.CHANGE]] += v * (1.0 - decay)
        if of_inputs[K.WARMING] >= 0:
            d_v[of_inputs[K.WARMING]] -= v * gain * decay * k / time**2
        v *= warmed
    if of_inputs[K.BIAS] >= 0:
        d_v[of_inputs[K.BIAS]] += 1.0
    return v + inputs[K.BIAS]


@compiled(nogil=True)
def limited_commands(u, w, static, inputs):  # type: ignore[no-untyped-def]
    """Every sample's command (samples,) behind limits of rate and size of the delayed command u along w
    (samples,); `static` begins with both limits."""
    found, none = np.empty(len(u)), np.full(len(inputs), -1)
    nothing = CommandTangents(
        0, np.zeros((0, LANES)), np.zeros(0), np.zeros(0), np.zeros((RAMPS, 0)), np.zeros(0, np.int64)
    )
    _limit_along(u, w, static, inputs, input_effects(inputs, none), none, np.zeros(RAMPS), nothing, found)
    return found


@compiled_loop
def _limit_along(u, w, static, inputs, effects, none, ramps, nothing, found):  # type: ignore[no-untyped-def]
    before = 0.0
    for k in range(len(u)):
        found[k] = behind_limits(
            u[k], True, w[k], before, static, inputs, 1, effects, none, none, ramps, nothing
        )
        before = w[k]
