"""Laws of torques, each once: its value and its derivatives, compiled, for records and for loops.

A law looks at a signal q, some at the position w too, has up to three parameters t0, t1, t2, and some have a
memory z, of which their torque is a multiple.
"""

from __future__ import annotations

import math

from bayes_hw.compiled import compiled
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812


@compiled(nogil=True)
def law_of(law, q, w, t0, t1, t2, memory, share, slopes):  # type: ignore[no-untyped-def]
    """Torque of a law over a step of `share` of a sample, its memory after it, and derivatives of the torque
    by q, w, t0, t1 and t2.

    Of a law with memory (K.BRISTLE, K.SLIP) derivatives are of the memory, by q, t0 and (the last) the memory
    before; `torque_of_memory` leads from there to its torque. Derivatives are right only where `slopes` are
    asked for.
    """
    by_q = by_w = by_t0 = by_t1 = by_t2 = by_memory = 0.0
    if law in (K.COULOMB, K.STRIBECK):
        t = math.tanh(q / t0)
        slope = (1.0 - t * t) / t0
        bell = bell_by_q = bell_by_width = 0.0
        if law == K.STRIBECK:
            bell = math.exp(-((q / t2) ** 2))
            bell_by_q = -2 * q / t2**2 * bell
            bell_by_width = 2 * q * q / t2**3 * bell
        tau = -t * (1 + t1 * bell)
        by_q = -slope * (1 + t1 * bell) - t * t1 * bell_by_q
        by_t0 = slope * q / t0 * (1 + t1 * bell)
        by_t1 = -t * bell
        by_t2 = -t * t1 * bell_by_width
    elif law == K.BRISTLE:
        sign = 1.0 if q >= 0 else -1.0
        path = abs(q) * share
        by_memory = math.exp(-path / t0)
        rest = (memory - sign) * by_memory
        memory = sign + rest
        tau = -memory
        by_q = -rest * sign * share / t0
        by_t0 = rest * path / t0**2
    elif law == K.SLIP:
        # What slipped follows the twist beyond what grips, like play.
        by_memory = 1.0
        if q - t0 > memory:
            memory, by_q, by_memory, by_t0 = q - t0, 1.0, 0.0, -1.0
        elif q + t0 < memory:
            memory, by_q, by_memory, by_t0 = q + t0, 1.0, 0.0, 1.0
        tau = memory / t0
    elif law == K.RIPPLE:
        s, of_zero = math.sin(t0 * q + t1), math.sin(t1)
        s2 = math.sin(2 * t0 * q + t1) if slopes or t2 != 0.0 else 0.0
        tau = s + t2 * s2 - (1 + t2) * of_zero
        if slopes:
            co, co2 = math.cos(t0 * q + t1), math.cos(2 * t0 * q + t1)
            by_q = t0 * (co + 2 * t2 * co2)
            by_t0 = q * (co + 2 * t2 * co2)
            by_t1 = co + t2 * co2 - (1 + t2) * math.cos(t1)
            by_t2 = s2 - of_zero
    elif law == K.CUBIC:
        r = q / t0
        below = 1 + t1 * r * r
        tau = r**3 / below
        by_q = (3 * r * r / below - r**3 * 2 * t1 * r / below**2) / t0
        by_t0 = -by_q * r
        by_t1 = -(r**5) / below**2
    elif law == K.GAP:
        r = q / t0
        if abs(r) < 1.0:
            tau, by_q, by_t0 = -r, -1 / t0, r / t0
        else:
            tau = -1.0 if r > 0 else 1.0
    elif law == K.EXCESS:
        r, tau = q / t0, 0.0
        if r > 1.0:
            tau, by_q, by_t0 = 1.0 - r, -1 / t0, r / t0
        elif r < -1.0:
            tau, by_q, by_t0 = -1.0 - r, -1 / t0, r / t0
    elif law == K.MODULATED:
        by_q = math.sin(t0 * w + t1)
        by_t1 = q * math.cos(t0 * w + t1) if slopes else 0.0
        tau = q * by_q
        by_w, by_t0 = t0 * by_t1, w * by_t1
    else:
        r = q / t0
        tau, by_q, by_t0 = -r * abs(r), -2 * abs(r) / t0, 2 * r * abs(r) / t0
    return tau, memory, by_q, by_w, by_t0, by_t1, by_t2, by_memory


@compiled(nogil=True)
def torque_of_memory(law, memory, t0):  # type: ignore[no-untyped-def]
    """Derivatives of a torque by its memory and, the memory held, by t0."""
    if law == K.BRISTLE:
        return -1.0, 0.0
    return 1.0 / t0, -memory / t0**2


@compiled(nogil=True)
def held_back(speed, own, t0, t1, t2, stribeck):  # type: ignore[no-untyped-def]
    """Friction's torque where the coming step's `speed` without it changes by `own` with a unit of it, and
    its derivatives by the speed, own, t0, t1 and t2: in proportion up to the smoothing speed,
    constant beyond."""
    most, most_by_speed, bell = 1.0, 0.0, 0.0
    if stribeck:
        bell = math.exp(-((speed / t2) ** 2))
        most += t1 * bell
        most_by_speed = -2 * speed / t2**2 * t1 * bell
    width = t0 + max(own, 0.0)
    tau = -speed / width
    if abs(tau) <= most:
        by_t0 = speed / width**2
        return tau, -1 / width, by_t0 if own > 0.0 else 0.0, by_t0, 0.0, 0.0
    sign = 1.0 if speed > 0 else -1.0
    return (
        -sign * most, -sign * most_by_speed, 0.0, 0.0, -sign * bell,
        -sign * t1 * bell * 2 * speed * speed / t2**3,
    )  # fmt: skip
