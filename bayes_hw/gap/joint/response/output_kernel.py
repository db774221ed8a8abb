"""Compiled: what the encoder shows of w, and its tangents.

`outputs` are the numbers of the effects as `effect_codes` has them and `columns.outputs` the column of each,
-1 where there is none.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from bayes_hw.compiled import compiled_inside, pasted
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.state_kernel import add
from bayes_hw.model.lanes import LANES, broadcast, load, store


class OutputEffects(NamedTuple):
    """Which effects stand between w and the reading, and the ratio of the gains to either side."""

    play: bool
    wave: bool
    settling: bool
    ratio: float


class Reading(NamedTuple):
    """A reading and its derivatives: `slope` by what a play has left of w, by the half width and by the
    logarithm of the ratio of gains; of the wave sine and cosine, of double frequency too, and `turned`, its
    derivative by its argument; what an offset that settles still lacks, `decay`."""

    y: float
    slope: float
    by_half_width: float
    by_ratio: float
    sine: float
    cosine: float
    sine2: float
    cosine2: float
    turned: float
    decay: float


@compiled_inside
def output_effects(outputs, of_outputs):  # type: ignore[no-untyped-def]
    """Those that do something, or whose tangents are asked for."""
    return OutputEffects(
        of_outputs[K.PLAY] >= 0 or outputs[K.PLAY] > 0.0,
        of_outputs[K.SINE] >= 0 or outputs[K.SINE] != 0.0 or outputs[K.COSINE] != 0.0,
        of_outputs[K.SETTLING] >= 0 or outputs[K.SETTLING] != 0.0,
        math.exp(outputs[K.LOG_RATIO]),
    )


@pasted
def played(out, w, play, of_play, plays, tangents):  # type: ignore[no-untyped-def]
    """Where w, within `play` to either side, leaves what was at `out`; its tangents are written. Without a
    play that is w."""
    if not plays:
        return w
    if w - play <= out <= w + play:
        return out
    for b in range(tangents.blocks):
        store(tangents.seen, b, load(tangents.w, b))
    if out < w - play:
        if of_play >= 0:
            tangents.each_seen[of_play] -= 1.0
        return w - play
    if of_play >= 0:
        tangents.each_seen[of_play] += 1.0
    return w + play


@pasted
def read(out, k, half_width, outputs, effects):  # type: ignore[no-untyped-def]
    """`Reading` of `out` at sample k, without what known inputs add to it."""
    y = slope = by_half_width = by_ratio = 0.0
    if out > half_width:
        slope, by_half_width, by_ratio = effects.ratio, -effects.ratio, effects.ratio * (out - half_width)
        y = by_ratio
    elif out < -half_width:
        slope, by_half_width, y = 1.0, 1.0, out + half_width
    s = co = s2 = co2 = turned = decay = 0.0
    if effects.wave:
        wave = outputs[K.WAVENUMBER]
        s, co = math.sin(wave * out), math.cos(wave * out)
        s2, co2 = 2 * s * co, 2 * co * co - 1
        y += (
            outputs[K.SINE] * s
            + outputs[K.COSINE] * (co - 1)
            + outputs[K.SINE2] * s2
            + outputs[K.COSINE2] * (co2 - 1)
        )
        turned = (
            outputs[K.SINE] * co
            - outputs[K.COSINE] * s
            + 2 * outputs[K.SINE2] * co2
            - 2 * outputs[K.COSINE2] * s2
        )
        slope += wave * turned
    y += outputs[K.RATE] * k
    if effects.settling:
        decay = math.exp(-k / outputs[K.SETTLING_TIME])
        y += outputs[K.SETTLING] * (1 - decay)
    return Reading(y, slope, by_half_width, by_ratio, s, co, s2, co2, turned, decay)


@pasted
def add_tangents_of_reading(reading, out, k, row, outputs, effects, columns, collected):  # type: ignore[no-untyped-def]
    """Added to the tangents that begin at `row`: what the numbers of the output themselves move."""
    of_outputs = columns.outputs
    if columns.static[2] >= 0:
        collected[row + columns.static[2]] += reading.by_half_width
    if of_outputs[K.LOG_RATIO] >= 0:
        collected[row + of_outputs[K.LOG_RATIO]] += reading.by_ratio
    if effects.wave:
        if of_outputs[K.SINE] >= 0:
            collected[row + of_outputs[K.SINE]] += reading.sine
            collected[row + of_outputs[K.COSINE]] += reading.cosine - 1
        if of_outputs[K.WAVENUMBER] >= 0:
            collected[row + of_outputs[K.WAVENUMBER]] += out * reading.turned
        if of_outputs[K.SINE2] >= 0:
            collected[row + of_outputs[K.SINE2]] += reading.sine2
            collected[row + of_outputs[K.COSINE2]] += reading.cosine2 - 1
    if of_outputs[K.RATE] >= 0:
        collected[row + of_outputs[K.RATE]] += k
    if of_outputs[K.SETTLING] >= 0:
        collected[row + of_outputs[K.SETTLING]] += 1 - reading.decay
    if of_outputs[K.SETTLING_TIME] >= 0:
        time = outputs[K.SETTLING_TIME]
        collected[row + of_outputs[K.SETTLING_TIME]] -= outputs[K.SETTLING] * reading.decay * k / time**2


@pasted
def innovation(j, shown, trust, y, out, static, of_half_width, first, tangents):  # type: ignore[no-untyped-def]
    """The torque of an observer, law j, to which `shown` stands against y; its tangents are written, those of
    y stand in the rows from `first` on. It looks at nothing where the dead zone hides w, and comes in over
    the edge beyond it."""
    half_width, edge, laws = static[2], static[3], len(tangents.torques) // max(tangents.blocks, 1)
    outside, direction = 1.0, 0.0
    if half_width > 0.0:
        outside = min(max((abs(out) - half_width) / edge, 0.0), 1.0)
        if 0.0 < outside < 1.0:
            direction = 1.0 if out > 0.0 else -1.0
    e = shown - y
    by_out = trust * direction * e / edge
    for b in range(tangents.blocks):
        reading = load(tangents.readings, first + b)
        found = broadcast(by_out) * load(tangents.seen, b) - broadcast(trust * outside) * reading
        store(tangents.torques, b * laws + j, found)
    if of_half_width >= 0:
        at = of_half_width // LANES * laws + j
        by_edge = -trust * abs(direction) * e / edge
        add(tangents.torques, at, of_half_width % LANES, by_edge, tangents.units)
    return trust * outside * e
