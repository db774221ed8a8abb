"""Compiled: what the laws of all torques look at and give over a step, and the tangents of both."""

from __future__ import annotations

from bayes_hw.compiled import pasted
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.law_kernel import held_back, law_of, torque_of_memory
from bayes_hw.gap.joint.response.state_kernel import add
from bayes_hw.model.lanes import LANES, broadcast, load, store


@pasted
def look(laws, motion, tangents):  # type: ignore[no-untyped-def]
    """Written: the signal of every law that looks at one; added to its tangents what v moves."""
    looks, carried, count, states = motion.looks, motion.carried, len(laws.law), len(motion.entered)
    for j in range(count):
        if laws.law[j] == K.INNOVATION:
            continue
        q = looks[1 + j, states] * carried[states]
        for i in range(states):
            q += looks[1 + j, i] * carried[i]
        motion.signals[j] = q
        if looks[1 + j, states] != 0.0:
            for c in tangents.moving:
                d_v = tangents.each_v[c]
                if d_v != 0.0:
                    at = c // LANES * count + j
                    add(tangents.signals, at, c % LANES, looks[1 + j, states] * d_v, tangents.units)


@pasted
def act(j, sample, w, laws, steps, columns, motion, tangents):  # type: ignore[no-untyped-def]
    """The torque of law j over a step; its memory goes on, and its tangents are written."""
    law, q = laws.law[j], motion.signals[j]
    t0, t1, t2 = laws.theta[j, 0], laws.theta[j, 1], laws.theta[j, 2]
    by_w = by_z = by_own = 0.0
    if law == K.KNOWN:
        tau, by_q, g0, g1, g2 = laws.forced[j, sample], 0.0, laws.by_lag[j, sample], 0.0, 0.0
    elif law in (K.COULOMB, K.STRIBECK) and laws.base[j] == K.BASE_SPEED:
        tau, by_q, by_own, g0, g1, g2 = held_back(q, motion.own[j], t0, t1, t2, law == K.STRIBECK)
        by_own *= steps
    else:
        tau, motion.memory[j], by_q, by_w, g0, g1, g2, by_z = law_of(
            law, q, w, t0, t1, t2, motion.memory[j], 1.0 / steps, tangents.size > 0
        )
    if tangents.size > 0:
        _act_on_tangents(
            j, law, t0, by_q, by_w, by_z, by_own, (g0, g1, g2), len(laws.law), columns, motion, tangents
        )
    return tau


@pasted
def _act_on_tangents(  # type: ignore[no-untyped-def]
    j, law, t0, by_q, by_w, by_z, by_own, by_theta, laws, columns, motion, tangents
):
    """Written: the tangents of a torque by the derivatives of its law."""
    of_theta, signals, memory, torques = columns.theta, tangents.signals, tangents.memory, tangents.torques
    g0, g1, g2 = by_theta
    if law in (K.BRISTLE, K.SLIP):
        for b in range(tangents.blocks):
            at = b * laws + j
            store(memory, at, broadcast(by_z) * load(memory, at) + broadcast(by_q) * load(signals, at))
        if of_theta[j, 0] >= 0:
            c = of_theta[j, 0]
            add(memory, c // LANES * laws + j, c % LANES, g0, tangents.units)
        by_z, g0 = torque_of_memory(law, motion.memory[j], t0)
        for b in range(tangents.blocks):
            at = b * laws + j
            store(torques, at, broadcast(by_z) * load(memory, at))
    else:
        for b in range(tangents.blocks):
            at = b * laws + j
            found = broadcast(by_q) * load(signals, at) + broadcast(by_w) * load(tangents.w, b)
            store(torques, at, found)
    for i, g in enumerate((g0, g1, g2)):
        c = of_theta[j, i]
        if c >= 0:
            add(torques, c // LANES * laws + j, c % LANES, g, tangents.units)
    if by_own != 0.0 and columns.paths.direct[j, 0] >= 0:
        for b in range(tangents.blocks):
            at = b * laws + j
            store(torques, at, load(torques, at) + broadcast(by_own) * load(tangents.own, at))
