"""Compiled position loop around a cascade with effects inside, sample by sample.

The axis is that of `joint_kernel.respond_jointly` without tangents; the controller that of
`bayes_hw.control.controller`, given as plain numbers.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled, compiled_loop
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.input_kernel import behind_gains, behind_limits, input_effects
from bayes_hw.gap.joint.response.motion_kernel import at_rest, tangents_at_rest
from bayes_hw.gap.joint.response.output_kernel import output_effects, played, read
from bayes_hw.gap.joint.response.state_kernel import advance, angle
from bayes_hw.gap.joint.response.torque_kernel import act, look
from bayes_hw.model.controller_kernel import STATES, next_command, start_at_rest


@compiled(nogil=True)
def loop_jointly(  # type: ignore[no-untyped-def]
    numbers, sections, ratio, delay, reference, noise, start, axis, steps, columns, u_out, w_out, y_out
):
    """`axis` from rest at w = `start`, `steps` steps a sample, behind a controller of `numbers` and
    `sections` (k, 5) that follows `reference` (samples,) once in `ratio` samples, sees `noise` (samples,) or
    none, and is heard `delay` samples later; `columns` are none. Written: command, w and output without noise
    (samples,)."""
    motion = at_rest(axis, steps)
    states = len(motion.entered)
    motion.carried[states - 2] = motion.carried[states - 1] = start
    before_g = input_effects(axis.inputs, columns.inputs)
    behind_g = output_effects(axis.outputs, columns.outputs)
    tangents = tangents_at_rest(axis, steps, columns, before_g.limits_move, behind_g.play)
    line, filters, state = np.zeros(max(delay, 1)), np.zeros((len(sections), 2)), np.zeros(STATES)
    _follow(
        numbers, sections, filters, state, ratio, line, delay, reference, noise, start, axis, steps, before_g,
        behind_g, columns, motion, tangents, u_out, w_out, y_out,
    )  # fmt: skip


@compiled_loop
def _follow(  # type: ignore[no-untyped-def]
    numbers, sections, filters, state, ratio, line, delay, reference, noise, out, axis, steps, before_g,
    behind_g, columns, motion, tangents, u_out, w_out, y_out,
):  # fmt: skip
    """The loop of `loop_jointly`; commands on their way stand in `line` (delay,)."""
    command = asked = 0.0
    states = len(motion.entered)
    for tick in range(len(reference) * steps):
        k, step = tick // steps, tick % steps
        w = angle(motion)
        if step == 0:
            out = played(out, w, axis.outputs[K.PLAY], -1, behind_g.play, tangents)
            y = read(out, k, axis.static[2], axis.outputs, behind_g).y
            if k % ratio == 0:
                error = reference[k] - y
                if noise.size > 0:
                    error -= noise[k]
                if k == 0:
                    start_at_rest(sections, reference[0] - y, filters, state)
                command = next_command(numbers, sections, error, filters, state)
            asked = command
            if delay > 0:
                asked = line[k % delay]
                line[k % delay] = command
            u_out[k], w_out[k], y_out[k] = command, w, y
        v = behind_limits(
            asked, step == 0, w, motion.carried[states - 1], axis.static, axis.inputs, steps, before_g,
            columns.static, columns.inputs, motion.ramps, tangents,
        )  # fmt: skip
        v = behind_gains(v, k + step / steps, axis.inputs, before_g, columns.inputs, tangents)
        motion.carried[states] = v
        look(axis.laws, motion, tangents)
        for j in range(len(axis.laws.law)):
            motion.torques[j] = act(j, 0, w, axis.laws, steps, columns, motion, tangents)
        advance(axis.paths, w, motion)
