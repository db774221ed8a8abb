"""Compiled response of a cascade with effects inside, and its tangents with respect to every parameter.

Every section is in transposed form, x1' = a1 x1 + x2 + b1 v + sum_j c1j tau_j, x2' = -a2 x1 + b2 v +
sum_j c2j tau_j, w = sum x1: a torque reaches w through the poles of G at its own coefficients, the *torque
port*. Its law looks at a signal q = base + sum (e1 x1 + e2 x2), the *signal port*; base is the command v
behind the input's effects, the speed of w, w itself, the motor's angle (w without what swings: the states of
G's integrator and real poles), or the twist of a spring and its rate: the second and
third difference by which w would go on from the states of G if nothing drove it, C (A - I)^2 x. What a
spring passes on depends on its twist and not on the acceleration, to which every torque adds. Friction of
the load meets the speed over the coming step, its own part in it included: it is solved for the torque, in
proportion up to the smoothing speed and constant beyond, and so holds the load still without a stiff law. No
drive train need be known.

Tangents are carried along sample by sample (forward differentiation), one column for each parameter: w, every
signal and every state are linear in the states before (`state_kernel`), a column follows them in one pass
over every section, and what feeds it or moves v is added where it is not zero.
"""

from __future__ import annotations

from bayes_hw.compiled import compiled, compiled_loop, pasted
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.input_kernel import behind_gains, behind_limits, input_effects
from bayes_hw.gap.joint.response.motion_kernel import WRITTEN_AT_ONCE, at_rest, tangents_at_rest
from bayes_hw.gap.joint.response.output_kernel import (
    add_tangents_of_reading,
    innovation,
    output_effects,
    played,
    read,
)
from bayes_hw.gap.joint.response.state_kernel import add_sources, advance, advance_tangents, angle
from bayes_hw.gap.joint.response.torque_kernel import act, look
from bayes_hw.model.lanes import broadcast, load, store


@compiled(nogil=True)
def respond_jointly(u, axis, steps, columns, run, rows):  # type: ignore[no-untyped-def]
    """One record from rest at w = 0, `steps` steps a sample, over each of which the command and every torque
    are held; poles, weights and ports are those of a step, all else is stated in samples.

    `u` (samples,): the delayed command; `axis`, `columns` and `run`: see `kernel_numbers`. Written: v, w,
    dy/dw, every law's torque and signal; added to what known inputs do to the readings: y, and `rows`
    (columns, samples), the tangents of y, given in those rows that begin with it.
    """
    before_g = input_effects(axis.inputs, columns.inputs)
    behind_g = output_effects(axis.outputs, columns.outputs)
    motion = at_rest(axis, steps)
    tangents = tangents_at_rest(axis, steps, columns, before_g.limits_move, behind_g.play)
    _respond(u, axis, steps, before_g, behind_g, columns, motion, tangents, run, rows)


@compiled_loop
def _respond(u, axis, steps, before_g, behind_g, columns, motion, tangents, run, rows):  # type: ignore[no-untyped-def]
    """The loop of `respond_jointly`."""
    laws, share, out, states = axis.laws, 1.0 / steps, 0.0, len(motion.entered)
    remembers = before_g.limits_move
    for j in range(len(laws.law)):
        remembers = remembers or motion.looks[1 + j, states - 1] != 0.0
    sample, within = 0, 0
    for _ in range(len(u) * steps):
        at_sample = within == 0
        w = angle(motion)
        v = behind_limits(
            u[sample], at_sample, w, motion.carried[states - 1], axis.static, axis.inputs, steps, before_g,
            columns.static, columns.inputs, motion.ramps, tangents,
        )  # fmt: skip
        v = behind_gains(v, sample + within * share, axis.inputs, before_g, columns.inputs, tangents)
        motion.carried[states] = v
        look(laws, motion, tangents)
        if tangents.size > 0:
            add_sources(tangents.signals, tangents.of_signals, motion.carried, tangents.units, True)
        for j in range(len(laws.law)):
            if laws.law[j] == K.INNOVATION:
                continue
            motion.torques[j] = act(j, sample, w, laws, steps, columns, motion, tangents)
            if at_sample:
                run.torques[j, sample], run.signals[j, sample] = motion.torques[j], motion.signals[j]
        out = played(out, w, axis.outputs[K.PLAY], columns.outputs[K.PLAY], behind_g.play, tangents)
        if at_sample:
            run.w[sample], run.v[sample] = w, 0.0
            _write_reading(sample, out, axis, behind_g, columns, motion, tangents, run, rows)
        run.v[sample] += v * share
        if tangents.size > 0:
            if remembers:
                for b in range(tangents.blocks):
                    store(tangents.states, b * states + states - 1, load(tangents.w, b))
            add_sources(tangents.fed, tangents.of_states, motion.carried, tangents.units, False)
            # Counted, since `advance_tangents` would be compiled for a constant False apart.
            driven = 0
            for c in tangents.moving:
                if tangents.each_v[c] != 0.0:
                    driven += 1
            advance_tangents(
                axis.paths.real, axis.paths.sections, axis.paths.direct, motion.enters, motion.looks,
                laws.law, tangents.states, tangents.fed, tangents.torques, tangents.v, driven > 0, tangents.w,
                tangents.signals,
            )  # fmt: skip
        advance(axis.paths, w, motion)
        within += 1
        if within == steps:
            within = 0
            sample += 1


@pasted
def _write_reading(sample, out, axis, effects, columns, motion, tangents, run, rows):  # type: ignore[no-untyped-def]
    """Written: the reading of a sample, its tangents once enough of them are there, and the torque of an
    observer, which looks at it."""
    laws, blocks = axis.laws, tangents.blocks
    shown = read(out, sample, axis.static[2], axis.outputs, effects)
    run.slope[sample] = shown.slope
    run.y[sample] += shown.y
    line = sample % WRITTEN_AT_ONCE
    row = line * len(tangents.each_w)
    for b in range(blocks):
        store(tangents.readings, line * blocks + b, broadcast(shown.slope) * load(tangents.seen, b))
    if tangents.size > 0:
        for c in columns.read:
            tangents.each_reading[row + c] += rows[c, sample]
        add_tangents_of_reading(
            shown, out, sample, row, axis.outputs, effects, columns, tangents.each_reading
        )
    for j in range(len(laws.law)):
        if laws.law[j] == K.INNOVATION:
            motion.torques[j] = run.torques[j, sample] = run.signals[j, sample] = innovation(
                j, laws.forced[j, sample], laws.by_lag[j, sample], run.y[sample], out, axis.static,
                columns.static[2], line * blocks, tangents,
            )  # fmt: skip
    if tangents.size > 0 and (line == WRITTEN_AT_ONCE - 1 or sample == rows.shape[1] - 1):
        for c in range(tangents.size):
            for i in range(line + 1):
                rows[c, sample - line + i] = tangents.each_reading[i * len(tangents.each_w) + c]
