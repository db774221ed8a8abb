"""Compiled position loop around a cascade with effects inside: one draw after another, sample by sample.

The axis is that of `joint_kernel.respond_jointly` without tangents; the controller that of
`bayes_hw.control.controller`, given as plain numbers.
"""

from __future__ import annotations

import math

import numpy as np

from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.law_kernel import held_back, law_of
from bayes_hw.gap.joint.response.ramp_kernel import ramped, ramped_within
from bayes_hw.gap.joint.response.state_kernel import own_difference
from bayes_hw.model.controller_kernel import STATES, next_command, start_at_rest


@compiled_inside
def limited_command(  # type: ignore[no-untyped-def]
    asked, w, speed, lower, upper, ins, early, late, held, steps, begins
):
    """The command over one of `steps` of a sample behind limits of rate and size, `ins` (INPUTS,), at w after
    a step of `speed`; both ramps after it, and to where a ramp moves at once in the sample that `begins` with
    this step."""
    ahead = w + ins[K.LIMIT_LEAD] * steps * speed
    a = ins[K.LIMIT_WAVENUMBER] * ahead
    factor = (
        1 + ins[K.LIMIT_SINE] * math.sin(a) + ins[K.LIMIT_COSINE] * math.cos(a) + ins[K.LIMIT_SLOPE] * ahead
    )
    lowest, highest = lower * factor, upper * factor
    v = asked
    if ins[K.EARLY_RATE] > 0.0:
        if begins:
            held = ramped(asked, early, ins[K.EARLY_RATE])[1]
        v, _, _, _, _, early, _, _ = ramped_within(asked, early, ins[K.EARLY_RATE] * steps, lowest, highest)
        v += ins[K.HELD] * (min(max(held, lowest), highest) - v)
    elif asked < lowest:
        v = lowest
    elif asked > highest:
        v = highest
    if ins[K.LATE_RATE] > 0.0:
        if begins:
            held = ramped(v, late, ins[K.LATE_RATE])[1]
        v, late, _, _, _, _ = ramped(v, late, ins[K.LATE_RATE] * steps)
        v += ins[K.HELD] * (held - v)
    return v, early, late, held


@compiled(nogil=True)
def limited_commands(u, w, lower, upper, ins):  # type: ignore[no-untyped-def]
    """Every sample's `limited_command` (samples,) of the delayed command u along w (samples,)."""
    found = np.empty(len(u))
    early = late = held = before = 0.0
    for k in range(len(u)):
        found[k], early, late, held = limited_command(
            u[k], w[k], w[k] - before, lower, upper, ins, early, late, held, 1, True
        )
        before = w[k]
    return found


@compiled(nogil=True)
def loop_jointly(  # type: ignore[no-untyped-def]
    numbers, controller_sections, ratio, delay, reference, noise, start, static, inputs, outputs, residue,
    real, sections, laws, bases, thetas, port_real, port_sections, direct, signal_real, signal_sections,
    steps, u_out, w_out, y_out,
):  # fmt: skip
    """Every draw d: `static` (d, 3), `inputs` (d, 12), `outputs` (d, 10), `residue` (d,), `real` (d, 2, n),
    `sections` (d, 4, m), and for law j `thetas` (d, j, 3), `port_real` (d, j, n), `port_sections`
    (d, j, 2, m), `direct` (d, j, 2), `signal_real` (d, j, n), `signal_sections` (d, j, 2, m), poles, weights
    and ports of one of `steps` steps a sample; `numbers` and `controller_sections` (k, 5) are the
    controller's; `reference` (samples,), `noise` (d, samples) or empty, `start` (d,) the position of w.
    Written: command, w and output without noise (d, samples)."""
    n_laws, samples = len(laws), len(reference)
    share = 1.0 / steps
    n_real, n_sections, n_filters = real.shape[2], sections.shape[2], len(controller_sections)
    for d in range(len(residue)):
        lower, upper, half_width = static[d]
        ins, outs = inputs[d], outputs[d]
        x_real, x1, x2 = np.zeros(n_real), np.zeros(n_sections), np.zeros(n_sections)
        memory, taus, x_direct = np.zeros(n_laws), np.zeros(n_laws), np.zeros(n_laws)
        integral, early, late, held = start[d], 0.0, 0.0, 0.0
        out = w1 = start[d]
        line = np.zeros(max(delay, 1))
        filters, state = np.zeros((n_filters, 2)), np.zeros(STATES)
        command = 0.0
        for k in range(samples):
            w = integral
            for i in range(n_real):
                w += x_real[i]
            for i in range(n_sections):
                w += x1[i]
            for j in range(n_laws):
                w += x_direct[j]
            # The output.
            out = min(max(out, w - outs[K.PLAY]), w + outs[K.PLAY])
            y = 0.0
            if out > half_width:
                y = math.exp(outs[K.LOG_RATIO]) * (out - half_width)
            elif out < -half_width:
                y = out + half_width
            if outs[K.SINE] != 0.0 or outs[K.COSINE] != 0.0:
                a = outs[K.WAVENUMBER] * out
                y += outs[K.SINE] * math.sin(a) + outs[K.COSINE] * (math.cos(a) - 1)
                y += outs[K.SINE2] * math.sin(2 * a) + outs[K.COSINE2] * (math.cos(2 * a) - 1)
            y += outs[K.RATE] * k + outs[K.SETTLING] * (1 - math.exp(-k / outs[K.SETTLING_TIME]))
            # The controller.
            if k % ratio == 0:
                error = reference[k] - y
                if noise.size > 0:
                    error -= noise[d, k]
                if k == 0:
                    start_at_rest(controller_sections, reference[0] - y, filters, state)
                command = next_command(numbers, controller_sections, error, filters, state)
            asked = command
            if delay > 0:
                asked = line[k % delay]
                line[k % delay] = command
            u_out[d, k], w_out[d, k], y_out[d, k] = command, w, y
            for step in range(steps):
                w = integral
                for i in range(n_real):
                    w += x_real[i]
                for i in range(n_sections):
                    w += x1[i]
                for j in range(n_laws):
                    w += x_direct[j]
                # The command behind the input's effects.
                v, early, late, held = limited_command(
                    asked, w, w - w1, lower, upper, ins, early, late, held, steps, step == 0
                )
                v += ins[K.EVEN_CURVE] * abs(v) + ins[K.ODD_CURVE] * abs(v) * v
                v *= 1 + ins[K.CHANGE] * (1 - math.exp(-(k + step / steps) / ins[K.WARMING]))
                v += ins[K.BIAS]
                # Torques.
                for j in range(n_laws):
                    q = w
                    if bases[j] == K.BASE_COMMAND:
                        q = v
                    elif bases[j] == K.BASE_SPEED and laws[j] in (K.COULOMB, K.STRIBECK):
                        q = residue[d] * v
                        for i in range(n_real):
                            q += (real[d, 0, i] - 1) * x_real[i] + real[d, 1, i] * v
                        for i in range(n_sections):
                            q += (sections[d, 0, i] - 1) * x1[i] + x2[i] + sections[d, 2, i] * v
                        for i in range(n_laws):
                            q += (direct[d, i, 1] - 1) * x_direct[i]
                        q *= steps
                    elif bases[j] == K.BASE_SPEED:
                        q = (w - w1) * steps
                    elif bases[j] == K.BASE_MOTOR:
                        q = integral
                        for i in range(n_real):
                            q += x_real[i]
                    elif bases[j] in (K.BASE_TWIST, K.BASE_TWIST_RATE):
                        power = 2 if bases[j] == K.BASE_TWIST else 3
                        scaled = float(steps) ** power
                        q = 0.0
                        for i in range(n_real):
                            q += scaled * (real[d, 0, i] - 1.0) ** power * x_real[i]
                        for i in range(n_sections):
                            e1, e2, _, _, _, _ = own_difference(sections[d, 0, i], sections[d, 1, i], power)
                            q += scaled * (e1 * x1[i] + e2 * x2[i])
                    for i in range(n_real):
                        q += signal_real[d, j, i] * x_real[i]
                    for i in range(n_sections):
                        q += signal_sections[d, j, 0, i] * x1[i] + signal_sections[d, j, 1, i] * x2[i]
                    t0, t1, t2 = thetas[d, j]
                    if bases[j] == K.BASE_SPEED and laws[j] in (K.COULOMB, K.STRIBECK):
                        own = direct[d, j, 0] + port_real[d, j].sum() + port_sections[d, j, 0].sum()
                        taus[j], _, _, _, _, _ = held_back(q, own * steps, t0, t1, t2, laws[j] == K.STRIBECK)
                    else:
                        taus[j], memory[j], _, _, _, _, _, _ = law_of(
                            laws[j], q, w, t0, t1, t2, memory[j], share, False
                        )
                # A step on.
                w1 = w
                integral += residue[d] * v
                for i in range(n_real):
                    x = real[d, 0, i] * x_real[i] + real[d, 1, i] * v
                    for j in range(n_laws):
                        x += port_real[d, j, i] * taus[j]
                    x_real[i] = x
                for i in range(n_sections):
                    one = x1[i]
                    x1[i] = sections[d, 0, i] * one + x2[i] + sections[d, 2, i] * v
                    x2[i] = sections[d, 3, i] * v - sections[d, 1, i] * one
                    for j in range(n_laws):
                        x1[i] += port_sections[d, j, 0, i] * taus[j]
                        x2[i] += port_sections[d, j, 1, i] * taus[j]
                for j in range(n_laws):
                    x_direct[j] = direct[d, j, 1] * x_direct[j] + direct[d, j, 0] * taus[j]
