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

import math

import numpy as np

from bayes_hw.compiled import compiled
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.response.law_kernel import held_back, law_of, torque_of_memory
from bayes_hw.gap.joint.response.ramp_kernel import ramped, ramped_within
from bayes_hw.gap.joint.response.state_kernel import (
    add,
    add_sources,
    advance_tangents,
    by_rows,
    entering,
    identity,
    moving_columns,
    own_columns,
    seen,
    signal_sources,
    state_sources,
    zeros,
)
from bayes_hw.model.lanes import LANES, broadcast, load, store

WRITTEN_AT_ONCE = 32
"""Samples of tangents that are collected before they are written row by row."""


@compiled(nogil=True)
def respond_jointly(  # type: ignore[no-untyped-def]
    u, static, inputs, outputs, residue, real, sections, laws, bases, thetas, port_real, port_sections,
    direct, signal_real, signal_sections, forced, forced_by_lag, steps, columns, c_static, c_inputs,
    c_outputs, c_residue, c_real, c_sections, c_thetas, c_port_real, c_port_sections, c_direct, c_signal_real,
    c_signal_sections, c_read, v_out, w_out, y_out, slope_out, tau_out, q_out, rows,
):  # fmt: skip
    """One record from rest at w = 0, `steps` steps a sample, over each of which the command and every torque
    are held; poles, weights and ports are those of a step, all else is stated in samples.

    `u` (samples,): the delayed command; `static` (4,): limits, half width, edge; `inputs` (12,) and `outputs`
    (10,) as `effect_codes` numbers them, rates as samples per unit, times in samples; `real` (2, n): poles
    and residues; `sections` (4, n); for every law j `thetas` (j, 3), `port_real` (j, n), `port_sections`
    (j, 2, n), `direct` (j, 2), `signal_real` (j, n) and `signal_sections` (j, 2, n); of a KNOWN law the
    torque `forced` and its derivative by the lag `forced_by_lag` (j, samples). An INNOVATION is a torque of
    what was measured, `forced`, less y, times `forced_by_lag`: zero in the dead zone, where y tells nothing
    of w, and growing over `edge` beyond it. The arrays c_... hold the column of each parameter or -1,
    `c_read` (n,) those of what is added to the readings.
    Written: v, w, dy/dw (samples,), every law's torque and signal (j, samples); added to what known inputs
    do to the readings: y (samples,) and `rows` (columns, samples), the tangents of y, given in rows `c_read`.
    """
    n_real, n_sections, n_laws = real.shape[1], sections.shape[1], len(laws)
    lower, upper, half_width, edge = static
    enters = entering(residue, real, sections, port_real, port_sections, direct)
    looks = seen(residue, real, sections, laws, bases, direct, signal_real, signal_sections, steps)
    states = enters.shape[1]
    at_sections, at_direct, at_integral, at_before = n_real, states - 2 - n_laws, states - 2, states - 1
    # States, v and torques; then tangents of these, of w, of signals and of memories.
    carried = np.zeros(states + 1 + n_laws)
    taus, memory = carried[states + 1 :], np.zeros(n_laws)
    signals, entered = np.zeros(n_laws), np.zeros(states)
    blocks = (columns + LANES - 1) // LANES
    padded, tangents = blocks * LANES, columns > 0
    of_states, fed_states = zeros(blocks * states), zeros(blocks * states)
    of_taus, of_signals, of_memory = zeros(blocks * n_laws), zeros(blocks * n_laws), zeros(blocks * n_laws)
    of_w, of_v, of_out = zeros(blocks), zeros(blocks), zeros(blocks)
    of_readings, units = zeros(WRITTEN_AT_ONCE * blocks), identity()
    # The same numbers one by one.
    d_w, d_v, d_out, collected = (
        of_w.reshape(-1), of_v.reshape(-1), of_out.reshape(-1), of_readings.reshape(-1),
    )  # fmt: skip
    d_early, d_late, d_held = np.zeros(padded), np.zeros(padded), np.zeros(padded)
    fed, signs = state_sources(c_residue, c_real, c_sections, c_port_real, c_port_sections, c_direct)
    fed_rows, fed, signs = by_rows(fed, signs, states)
    turned_by, turns = signal_sources(
        real, sections, laws, bases, steps, c_residue, c_real, c_sections, c_direct, c_signal_real,
        c_signal_sections,
    )  # fmt: skip
    turned_rows, turned_by, turns = by_rows(turned_by, turns, n_laws)
    # `own` is the speed that a unit of a torque makes up over the step that it acts on.
    remembers, own = False, np.zeros(n_laws)
    for j in range(n_laws):
        remembers = remembers or looks[1 + j, at_before] != 0.0
        for i in range(states):
            own[j] += steps * (enters[1 + j, i] * looks[0, i])
    of_own = own_columns(blocks, c_direct, c_port_real, c_port_sections)
    early = late = out = 0.0
    gain, ratio = inputs[K.CHANGE], math.exp(outputs[K.LOG_RATIO])
    wave, limit_wave = outputs[K.WAVENUMBER], inputs[K.LIMIT_WAVENUMBER]
    limits_move = c_inputs[K.LIMIT_SINE] >= 0 or c_inputs[K.LIMIT_SLOPE] >= 0 or inputs[K.LIMIT_SLOPE] != 0.0
    limits_move = limits_move or inputs[K.LIMIT_SINE] != 0.0 or inputs[K.LIMIT_COSINE] != 0.0
    # Limits look at the angle as it is so many steps on, at the speed of the last one.
    lead = inputs[K.LIMIT_LEAD] * steps
    has_wave = c_outputs[K.SINE] >= 0 or outputs[K.SINE] != 0.0 or outputs[K.COSINE] != 0.0
    has_early = c_inputs[K.EARLY_RATE] >= 0 or inputs[K.EARLY_RATE] > 0.0
    has_late = c_inputs[K.LATE_RATE] >= 0 or inputs[K.LATE_RATE] > 0.0
    share_held, held = inputs[K.HELD], 0.0
    has_held = c_inputs[K.HELD] >= 0 or share_held != 0.0
    even, odd = inputs[K.EVEN_CURVE], inputs[K.ODD_CURVE]
    has_curve = c_inputs[K.EVEN_CURVE] >= 0 or even != 0.0 or odd != 0.0
    has_change = c_inputs[K.CHANGE] >= 0 or gain != 0.0
    has_play = c_outputs[K.PLAY] >= 0 or outputs[K.PLAY] > 0.0
    has_settling = c_outputs[K.SETTLING] >= 0 or outputs[K.SETTLING] != 0.0
    remembers = remembers or limits_move
    moving = moving_columns(columns, limits_move, c_static, c_inputs)
    d_seen, of_seen = (d_out, of_out) if has_play else (d_w, of_w)
    share, sample, within = 1.0 / steps, 0, 0
    for _ in range(len(u) * steps):
        k = sample + within * share
        at_sample = within == 0
        w = 0.0
        for i in range(at_before):
            w += looks[0, i] * carried[i]
        # The command behind the input's effects.
        asked = u[sample]
        for c in moving:
            d_v[c] = 0.0
        factor = 1.0
        if limits_move:
            speed = w - carried[at_before]
            ahead = w + lead * speed
            s, co = math.sin(limit_wave * ahead), math.cos(limit_wave * ahead)
            factor += inputs[K.LIMIT_SINE] * s + inputs[K.LIMIT_COSINE] * co + inputs[K.LIMIT_SLOPE] * ahead
            turned = inputs[K.LIMIT_SINE] * co - inputs[K.LIMIT_COSINE] * s
        lowest, highest = lower * factor, upper * factor
        if has_early:
            limited, by_lowest, by_highest, by_rate, by_before, end, end_by_rate, end_by_before = (
                ramped_within(asked, early, inputs[K.EARLY_RATE] * steps, lowest, highest)
            )
            by_rate *= steps
            end_by_rate *= steps
            if has_held and at_sample:
                _, held, _, _, held_by_rate, held_by_before = ramped(asked, early, inputs[K.EARLY_RATE])
                for c in moving:
                    d_held[c] = held_by_before * d_early[c]
                if c_inputs[K.EARLY_RATE] >= 0:
                    d_held[c_inputs[K.EARLY_RATE]] += held_by_rate
            early = end
            for c in moving:
                d_v[c] = by_before * d_early[c]
                d_early[c] *= end_by_before
            if c_inputs[K.EARLY_RATE] >= 0:
                d_v[c_inputs[K.EARLY_RATE]] += by_rate
                d_early[c_inputs[K.EARLY_RATE]] += end_by_rate
            if has_held:
                stepped = min(max(held, lowest), highest)
                free = share_held if stepped == held else 0.0
                for c in moving:
                    d_v[c] = (1.0 - share_held) * d_v[c] + free * d_held[c]
                if c_inputs[K.HELD] >= 0:
                    d_v[c_inputs[K.HELD]] += stepped - limited
                by_lowest = (1.0 - share_held) * by_lowest + (share_held if held < lowest else 0.0)
                by_highest = (1.0 - share_held) * by_highest + (share_held if held > highest else 0.0)
                limited += share_held * (stepped - limited)
        else:
            limited, by_lowest, by_highest = asked, 0.0, 0.0
            if asked < lowest:
                limited, by_lowest = lowest, 1.0
            elif asked > highest:
                limited, by_highest = highest, 1.0
        if by_lowest != 0.0 or by_highest != 0.0:
            by_factor = 0.0
            if by_lowest != 0.0:
                by_factor += by_lowest * lower
                if c_static[0] >= 0:
                    d_v[c_static[0]] += by_lowest * factor
            if by_highest != 0.0:
                by_factor += by_highest * upper
                if c_static[1] >= 0:
                    d_v[c_static[1]] += by_highest * factor
            if limits_move:
                by_ahead = by_factor * (limit_wave * turned + inputs[K.LIMIT_SLOPE])
                for c in moving:
                    d_v[c] += by_ahead * (
                        (1.0 + lead) * d_w[c] - lead * of_states[c // LANES * states + at_before, c % LANES]
                    )
                if c_inputs[K.LIMIT_SINE] >= 0:
                    d_v[c_inputs[K.LIMIT_SINE]] += by_factor * s
                    d_v[c_inputs[K.LIMIT_COSINE]] += by_factor * co
                    d_v[c_inputs[K.LIMIT_LEAD]] += by_ahead * steps * speed
                    d_v[c_inputs[K.LIMIT_WAVENUMBER]] += by_factor * ahead * turned
                if c_inputs[K.LIMIT_SLOPE] >= 0:
                    d_v[c_inputs[K.LIMIT_SLOPE]] += by_factor * ahead
        v = limited
        if has_late:
            v, late_end, by_rate, by_before, end_by_rate, end_by_before = ramped(
                limited, late, inputs[K.LATE_RATE] * steps
            )
            by_rate *= steps
            end_by_rate *= steps
            if has_held and at_sample:
                _, held, _, _, held_by_rate, held_by_before = ramped(limited, late, inputs[K.LATE_RATE])
                for c in moving:
                    d_held[c] = (1.0 - held_by_before) * d_v[c] + held_by_before * d_late[c]
                if c_inputs[K.LATE_RATE] >= 0:
                    d_held[c_inputs[K.LATE_RATE]] += held_by_rate
            for c in moving:
                to_target = d_v[c]
                d_v[c] = (1.0 - by_before) * to_target + by_before * d_late[c]
                d_late[c] = (1.0 - end_by_before) * to_target + end_by_before * d_late[c]
            if c_inputs[K.LATE_RATE] >= 0:
                d_v[c_inputs[K.LATE_RATE]] += by_rate
                d_late[c_inputs[K.LATE_RATE]] += end_by_rate
            late = late_end
            if has_held:
                for c in moving:
                    d_v[c] += share_held * (d_held[c] - d_v[c])
                if c_inputs[K.HELD] >= 0:
                    d_v[c_inputs[K.HELD]] += held - v
                v += share_held * (held - v)
        if has_curve:
            size = abs(v)
            bent = 1.0 + 2 * odd * size + (even if v > 0 else -even)
            for c in moving:
                d_v[c] *= bent
            if c_inputs[K.EVEN_CURVE] >= 0:
                d_v[c_inputs[K.EVEN_CURVE]] += size
                d_v[c_inputs[K.ODD_CURVE]] += size * v
            v += even * size + odd * size * v
        if has_change:
            decay = math.exp(-k / inputs[K.WARMING])
            warmed = 1.0 + gain * (1.0 - decay)
            for c in moving:
                d_v[c] *= warmed
            if c_inputs[K.CHANGE] >= 0:
                d_v[c_inputs[K.CHANGE]] += v * (1.0 - decay)
            if c_inputs[K.WARMING] >= 0:
                d_v[c_inputs[K.WARMING]] -= v * gain * decay * k / inputs[K.WARMING] ** 2
            v *= warmed
        v += inputs[K.BIAS]
        if c_inputs[K.BIAS] >= 0:
            d_v[c_inputs[K.BIAS]] += 1.0
        carried[states] = v
        # Torques.
        for j in range(n_laws):
            if laws[j] == K.INNOVATION:
                continue
            q = looks[1 + j, states] * v
            for i in range(states):
                q += looks[1 + j, i] * carried[i]
            signals[j] = q
            if tangents and looks[1 + j, states] != 0.0:
                for c in moving:
                    if d_v[c] != 0.0:
                        at = c // LANES * n_laws + j
                        add(of_signals, at, c % LANES, looks[1 + j, states] * d_v[c], units)
        if tangents:
            add_sources(of_signals, turned_rows, turned_by, turns, carried, units, True)
        for j in range(n_laws):
            if laws[j] == K.INNOVATION:
                continue
            q = signals[j]
            t0, t1, t2 = thetas[j, 0], thetas[j, 1], thetas[j, 2]
            law, friction = laws[j], laws[j] in (K.COULOMB, K.STRIBECK) and bases[j] == K.BASE_SPEED
            by_w = by_z = by_own = 0.0
            if law == K.KNOWN:
                tau, by_q, g0, g1, g2 = forced[j, sample], 0.0, forced_by_lag[j, sample], 0.0, 0.0
            elif friction:
                tau, by_q, by_own, g0, g1, g2 = held_back(q, own[j], t0, t1, t2, law == K.STRIBECK)
                by_own *= steps
            else:
                tau, memory[j], by_q, by_w, g0, g1, g2, by_z = law_of(
                    law, q, w, t0, t1, t2, memory[j], share, tangents
                )
            taus[j] = tau
            if at_sample:
                tau_out[j, sample], q_out[j, sample] = tau, q
            if not tangents:
                continue
            if law in (K.BRISTLE, K.SLIP):
                for b in range(blocks):
                    at = b * n_laws + j
                    store(
                        of_memory, at,
                        broadcast(by_z) * load(of_memory, at) + broadcast(by_q) * load(of_signals, at),
                    )  # fmt: skip
                if c_thetas[j, 0] >= 0:
                    c = c_thetas[j, 0]
                    add(of_memory, c // LANES * n_laws + j, c % LANES, g0, units)
                by_z, g0 = torque_of_memory(law, memory[j], t0)
                for b in range(blocks):
                    at = b * n_laws + j
                    store(of_taus, at, broadcast(by_z) * load(of_memory, at))
            else:
                for b in range(blocks):
                    at = b * n_laws + j
                    found = broadcast(by_q) * load(of_signals, at) + broadcast(by_w) * load(of_w, b)
                    store(of_taus, at, found)
            for i, g in enumerate((g0, g1, g2)):
                c = c_thetas[j, i]
                if c >= 0:
                    add(of_taus, c // LANES * n_laws + j, c % LANES, g, units)
            if by_own != 0.0 and c_direct[j, 0] >= 0:
                for b in range(blocks):
                    at = b * n_laws + j
                    store(of_taus, at, load(of_taus, at) + broadcast(by_own) * load(of_own, at))
        # The output.
        if has_play:
            play = outputs[K.PLAY]
            if out < w - play:
                out = w - play
                for b in range(blocks):
                    store(of_seen, b, load(of_w, b))
                if c_outputs[K.PLAY] >= 0:
                    d_seen[c_outputs[K.PLAY]] -= 1.0
            elif out > w + play:
                out = w + play
                for b in range(blocks):
                    store(of_seen, b, load(of_w, b))
                if c_outputs[K.PLAY] >= 0:
                    d_seen[c_outputs[K.PLAY]] += 1.0
        else:
            out = w
        if at_sample:
            y, slope_y, by_half, by_ratio = y_out[sample], 0.0, 0.0, 0.0
            if out > half_width:
                slope_y, by_half, by_ratio = ratio, -ratio, ratio * (out - half_width)
                y += by_ratio
            elif out < -half_width:
                y += out + half_width
                slope_y, by_half = 1.0, 1.0
            if has_wave:
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
                slope_y += wave * turned
            y += outputs[K.RATE] * k
            if has_settling:
                decay = math.exp(-k / outputs[K.SETTLING_TIME])
                y += outputs[K.SETTLING] * (1 - decay)
            row = sample % WRITTEN_AT_ONCE * padded
            for b in range(blocks):
                store(
                    of_readings, sample % WRITTEN_AT_ONCE * blocks + b, broadcast(slope_y) * load(of_seen, b)
                )
            if tangents:
                for c in c_read:
                    collected[row + c] += rows[c, sample]
                if c_static[2] >= 0:
                    collected[row + c_static[2]] += by_half
                if c_outputs[K.LOG_RATIO] >= 0:
                    collected[row + c_outputs[K.LOG_RATIO]] += by_ratio
                if has_wave:
                    if c_outputs[K.SINE] >= 0:
                        collected[row + c_outputs[K.SINE]] += s
                        collected[row + c_outputs[K.COSINE]] += co - 1
                    if c_outputs[K.WAVENUMBER] >= 0:
                        collected[row + c_outputs[K.WAVENUMBER]] += out * turned
                    if c_outputs[K.SINE2] >= 0:
                        collected[row + c_outputs[K.SINE2]] += s2
                        collected[row + c_outputs[K.COSINE2]] += co2 - 1
                if c_outputs[K.RATE] >= 0:
                    collected[row + c_outputs[K.RATE]] += k
                if c_outputs[K.SETTLING] >= 0:
                    collected[row + c_outputs[K.SETTLING]] += 1 - decay
                if c_outputs[K.SETTLING_TIME] >= 0:
                    collected[row + c_outputs[K.SETTLING_TIME]] -= (
                        outputs[K.SETTLING] * decay * k / outputs[K.SETTLING_TIME] ** 2
                    )
            # What the encoder shows beyond that.
            for j in range(n_laws):
                if laws[j] != K.INNOVATION:
                    continue
                e = forced[j, sample] - y
                outside, direction = 1.0, 0.0
                if half_width > 0.0:
                    outside = min(max((abs(out) - half_width) / edge, 0.0), 1.0)
                    if 0.0 < outside < 1.0:
                        direction = 1.0 if out > 0.0 else -1.0
                trust = forced_by_lag[j, sample]
                taus[j] = trust * outside * e
                by_out = trust * direction * e / edge
                for b in range(blocks):
                    reading = load(of_readings, sample % WRITTEN_AT_ONCE * blocks + b)
                    found = broadcast(by_out) * load(of_seen, b) - broadcast(trust * outside) * reading
                    store(of_taus, b * n_laws + j, found)
                c = c_static[2]
                if c >= 0:
                    add(
                        of_taus, c // LANES * n_laws + j, c % LANES, -trust * abs(direction) * e / edge, units
                    )
                tau_out[j, sample] = q_out[j, sample] = taus[j]
            w_out[sample], y_out[sample], slope_out[sample] = w, y, slope_y
            if tangents and (sample % WRITTEN_AT_ONCE == WRITTEN_AT_ONCE - 1 or sample == len(u) - 1):
                begin = sample // WRITTEN_AT_ONCE * WRITTEN_AT_ONCE
                for c in range(columns):
                    for i in range(sample - begin + 1):
                        rows[c, begin + i] = collected[i * padded + c]
            v_out[sample] = 0.0
        v_out[sample] += v * share
        # States and their tangents a step on, with those of w and of every signal.
        if tangents:
            if remembers:
                for b in range(blocks):
                    store(of_states, b * states + at_before, load(of_w, b))
            add_sources(fed_states, fed_rows, fed, signs, carried, units, False)
            # Counted, since `advance_tangents` would be compiled for a constant False apart.
            driven = 0
            for c in moving:
                if d_v[c] != 0.0:
                    driven += 1
            advance_tangents(
                real, sections, direct, enters, looks, laws, of_states, fed_states, of_taus, of_v, driven > 0,
                of_w, of_signals, at_direct,
            )  # fmt: skip
        for i in range(states):
            entered[i] = enters[0, i] * v
        for j in range(n_laws):
            for i in range(states):
                entered[i] += enters[1 + j, i] * taus[j]
        for i in range(n_real):
            carried[i] = real[0, i] * carried[i] + entered[i]
        for i in range(n_sections):
            at = at_sections + 2 * i
            one = carried[at]
            carried[at] = sections[0, i] * one + carried[at + 1] + entered[at]
            carried[at + 1] = entered[at + 1] - sections[1, i] * one
        for j in range(n_laws):
            carried[at_direct + j] = direct[j, 1] * carried[at_direct + j] + entered[at_direct + j]
        carried[at_integral] += entered[at_integral]
        carried[at_before] = w
        within += 1
        if within == steps:
            within = 0
            sample += 1
