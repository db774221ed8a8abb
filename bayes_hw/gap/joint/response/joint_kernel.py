"""Compiled response of a cascade with effects inside, and its tangents with respect to every parameter.

Every section is in transposed form, x1' = a1 x1 + x2 + b1 v + sum_j c1j tau_j, x2' = -a2 x1 + b2 v +
sum_j c2j tau_j, w = sum x1: a torque reaches w through the poles of G at its own coefficients, the *torque
port*. Its law looks at a signal q = base + sum (e1 x1 + e2 x2), the *signal port*; base is the command v
behind the input's effects, the speed of w, w itself, or the twist of a spring and its rate: the second and
third difference by which w would go on from the states of G if nothing drove it, C (A - I)^2 x. What a
spring passes on depends on its twist and not on the acceleration, to which every torque adds. Friction of
the load meets the speed over the coming step, its own part in it included: it is solved for the torque, in
proportion up to the smoothing speed and constant beyond, and so holds the load still without a stiff law. No
drive train need be known.

Tangents are carried along sample by sample (forward differentiation), one column for each parameter.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from bayes_hw.gap.joint.forms.effect_codes import (
    BASE_COMMAND,
    BASE_SPEED,
    BASE_TWIST,
    BASE_TWIST_RATE,
    BIAS,
    BRISTLE,
    CHANGE,
    COSINE,
    COSINE2,
    COULOMB,
    EARLY_RATE,
    EVEN_CURVE,
    INNOVATION,
    KNOWN,
    LATE_RATE,
    LIMIT_COSINE,
    LIMIT_SINE,
    LIMIT_SLOPE,
    LIMIT_WAVENUMBER,
    LOG_RATIO,
    ODD_CURVE,
    PLAY,
    RATE,
    SETTLING,
    SETTLING_TIME,
    SINE,
    SINE2,
    SLIP,
    STRIBECK,
    WARMING,
    WAVENUMBER,
)
from bayes_hw.gap.joint.response.law_kernel import held_back, law_of, torque_of_memory
from bayes_hw.gap.joint.response.ramp_kernel import ramped, ramped_within


@njit(cache=True, nogil=True, error_model="numpy")
def respond_jointly(  # type: ignore[no-untyped-def]
    u, static, inputs, outputs, residue, real, sections, laws, bases, thetas, port_real, port_sections,
    direct, signal_real, signal_sections, forced, forced_by_lag, steps, columns, c_static, c_inputs,
    c_outputs, c_residue, c_real, c_sections, c_thetas, c_port_real, c_port_sections, c_direct, c_signal_real,
    c_signal_sections, work, v_out, w_out, y_out, slope_out, tau_out, q_out, rows,
):  # fmt: skip
    """One record from rest at w = 0, `steps` steps a sample, over each of which the command and every torque
    are held; poles, weights and ports are those of a step, all else is stated in samples.

    `u` (samples,): the delayed command; `static` (4,): limits, half width, edge; `inputs` (11,) and `outputs`
    (10,) as `effect_codes` numbers them, rates as samples per unit, times in samples; `real` (2, n): poles
    and residues; `sections` (4, n); for every law j `thetas` (j, 3), `port_real` (j, n), `port_sections`
    (j, 2, n), `direct` (j, 2), `signal_real` (j, n) and `signal_sections` (j, 2, n); of a KNOWN law the
    torque `forced` and its derivative by the lag `forced_by_lag` (j, samples). An INNOVATION is a torque of
    what was measured, `forced`, less y, times `forced_by_lag`: zero in the dead zone, where y tells nothing
    of w, and growing over `edge` beyond it. The arrays c_... hold the column of each parameter or -1. `work`
    (rows, columns) is scratch of 7 + real poles + 2 sections + 4 laws rows.
    Written: v, w, dy/dw (samples,), every law's torque and signal (j, samples); added to what known inputs
    do to the readings: y (samples,) and `rows` (columns, samples), the tangents of y.
    """
    work[:, :] = 0.0
    n_real, n_sections, n_laws = real.shape[1], sections.shape[1], len(laws)
    lower, upper, half_width, edge = static
    d_v, d_w, d_w1, d_early, d_late, d_out, d_i = (
        work[0], work[1], work[2], work[3], work[4], work[5], work[6],
    )  # fmt: skip
    at_real = 7
    at_sections = at_real + n_real
    at_tau = at_sections + 2 * n_sections
    at_q = at_tau + n_laws
    at_memory = at_q + n_laws
    at_direct = at_memory + n_laws
    integral = early = late = out = w1 = 0.0
    x_real, x1, x2 = np.zeros(n_real), np.zeros(n_sections), np.zeros(n_sections)
    memory, taus, x_direct = np.zeros(n_laws), np.zeros(n_laws), np.zeros(n_laws)
    gain, ratio = inputs[CHANGE], math.exp(outputs[LOG_RATIO])
    wave, limit_wave = outputs[WAVENUMBER], inputs[LIMIT_WAVENUMBER]
    has_limit_wave = c_inputs[LIMIT_SINE] >= 0 or inputs[LIMIT_SINE] != 0.0 or inputs[LIMIT_COSINE] != 0.0
    has_limit_slope = c_inputs[LIMIT_SLOPE] >= 0 or inputs[LIMIT_SLOPE] != 0.0
    has_wave = c_outputs[SINE] >= 0 or outputs[SINE] != 0.0 or outputs[COSINE] != 0.0
    has_early = c_inputs[EARLY_RATE] >= 0 or inputs[EARLY_RATE] > 0.0
    has_late = c_inputs[LATE_RATE] >= 0 or inputs[LATE_RATE] > 0.0
    even, odd = inputs[EVEN_CURVE], inputs[ODD_CURVE]
    has_curve = c_inputs[EVEN_CURVE] >= 0 or even != 0.0 or odd != 0.0
    has_change = c_inputs[CHANGE] >= 0 or gain != 0.0
    has_play = c_outputs[PLAY] >= 0 or outputs[PLAY] > 0.0
    has_settling = c_outputs[SETTLING] >= 0 or outputs[SETTLING] != 0.0
    share = 1.0 / steps
    for step in range(len(u) * steps):
        sample, k = step // steps, step * share
        at_sample = step % steps == 0
        # w and its tangents.
        w = integral
        for i in range(n_real):
            w += x_real[i]
        for i in range(n_sections):
            w += x1[i]
        for j in range(n_laws):
            w += x_direct[j]
        for c in range(columns):
            d_w[c] = d_i[c]
        for i in range(n_real):
            d_x = work[at_real + i]
            for c in range(columns):
                d_w[c] += d_x[c]
        for i in range(n_sections):
            d_x = work[at_sections + 2 * i]
            for c in range(columns):
                d_w[c] += d_x[c]
        for j in range(n_laws):
            d_x = work[at_direct + j]
            for c in range(columns):
                d_w[c] += d_x[c]
        # The command behind the input's effects.
        asked = u[sample]
        for c in range(columns):
            d_v[c] = 0.0
        factor, factor_by_w = 1.0, 0.0
        if has_limit_wave:
            s, co = math.sin(limit_wave * w), math.cos(limit_wave * w)
            factor += inputs[LIMIT_SINE] * s + inputs[LIMIT_COSINE] * co
            turned = inputs[LIMIT_SINE] * co - inputs[LIMIT_COSINE] * s
            factor_by_w += limit_wave * turned
        if has_limit_slope:
            factor += inputs[LIMIT_SLOPE] * w
            factor_by_w += inputs[LIMIT_SLOPE]
        lowest, highest = lower * factor, upper * factor
        if has_early:
            limited, by_lowest, by_highest, by_rate, by_before, end, end_by_rate, end_by_before = (
                ramped_within(asked, early, inputs[EARLY_RATE] * steps, lowest, highest)
            )
            by_rate *= steps
            end_by_rate *= steps
            early = end
            for c in range(columns):
                d_v[c] = by_before * d_early[c]
                d_early[c] *= end_by_before
            if c_inputs[EARLY_RATE] >= 0:
                d_v[c_inputs[EARLY_RATE]] += by_rate
                d_early[c_inputs[EARLY_RATE]] += end_by_rate
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
            for c in range(columns):
                d_v[c] += by_factor * factor_by_w * d_w[c]
            if has_limit_wave:
                if c_inputs[LIMIT_SINE] >= 0:
                    d_v[c_inputs[LIMIT_SINE]] += by_factor * s
                    d_v[c_inputs[LIMIT_COSINE]] += by_factor * co
                if c_inputs[LIMIT_WAVENUMBER] >= 0:
                    d_v[c_inputs[LIMIT_WAVENUMBER]] += by_factor * w * turned
            if c_inputs[LIMIT_SLOPE] >= 0:
                d_v[c_inputs[LIMIT_SLOPE]] += by_factor * w
        v = limited
        if has_late:
            v, late_end, by_rate, by_before, end_by_rate, end_by_before = ramped(
                limited, late, inputs[LATE_RATE] * steps
            )
            by_rate *= steps
            end_by_rate *= steps
            for c in range(columns):
                to_target = d_v[c]
                d_v[c] = (1.0 - by_before) * to_target + by_before * d_late[c]
                d_late[c] = (1.0 - end_by_before) * to_target + end_by_before * d_late[c]
            if c_inputs[LATE_RATE] >= 0:
                d_v[c_inputs[LATE_RATE]] += by_rate
                d_late[c_inputs[LATE_RATE]] += end_by_rate
            late = late_end
        if has_curve:
            size = abs(v)
            bent = 1.0 + 2 * odd * size + (even if v > 0 else -even)
            for c in range(columns):
                d_v[c] *= bent
            if c_inputs[EVEN_CURVE] >= 0:
                d_v[c_inputs[EVEN_CURVE]] += size
                d_v[c_inputs[ODD_CURVE]] += size * v
            v += even * size + odd * size * v
        if has_change:
            decay = math.exp(-k / inputs[WARMING])
            warmed = 1.0 + gain * (1.0 - decay)
            for c in range(columns):
                d_v[c] *= warmed
            if c_inputs[CHANGE] >= 0:
                d_v[c_inputs[CHANGE]] += v * (1.0 - decay)
            if c_inputs[WARMING] >= 0:
                d_v[c_inputs[WARMING]] -= v * gain * decay * k / inputs[WARMING] ** 2
            v *= warmed
        v += inputs[BIAS]
        if c_inputs[BIAS] >= 0:
            d_v[c_inputs[BIAS]] += 1.0
        # Torques.
        for j in range(n_laws):
            if laws[j] == INNOVATION:
                continue
            d_q, d_tau, d_z = work[at_q + j], work[at_tau + j], work[at_memory + j]
            base = bases[j]
            if base == BASE_COMMAND:
                q = v
                for c in range(columns):
                    d_q[c] = d_v[c]
            elif base == BASE_SPEED and laws[j] in (COULOMB, STRIBECK):
                ahead = residue * v
                for c in range(columns):
                    d_q[c] = residue * d_v[c]
                if c_residue >= 0:
                    d_q[c_residue] += v
                for i in range(n_real):
                    pole, weight, d_x = real[0, i] - 1.0, real[1, i], work[at_real + i]
                    ahead += pole * x_real[i] + weight * v
                    for c in range(columns):
                        d_q[c] += pole * d_x[c] + weight * d_v[c]
                    if c_real[0, i] >= 0:
                        d_q[c_real[0, i]] += x_real[i]
                        d_q[c_real[1, i]] += v
                for i in range(n_sections):
                    a1, b1 = sections[0, i] - 1.0, sections[2, i]
                    d_one, d_two = work[at_sections + 2 * i], work[at_sections + 2 * i + 1]
                    ahead += a1 * x1[i] + x2[i] + b1 * v
                    for c in range(columns):
                        d_q[c] += a1 * d_one[c] + d_two[c] + b1 * d_v[c]
                    if c_sections[0, i] >= 0:
                        d_q[c_sections[0, i]] += x1[i]
                        d_q[c_sections[2, i]] += v
                for i in range(n_laws):
                    pole, d_x = direct[i, 1] - 1.0, work[at_direct + i]
                    ahead += pole * x_direct[i]
                    for c in range(columns):
                        d_q[c] += pole * d_x[c]
                    if c_direct[i, 1] >= 0:
                        d_q[c_direct[i, 1]] += x_direct[i]
                q = ahead * steps
                for c in range(columns):
                    d_q[c] *= steps
            elif base == BASE_SPEED:
                q = (w - w1) * steps
                for c in range(columns):
                    d_q[c] = (d_w[c] - d_w1[c]) * steps
            elif base in (BASE_TWIST, BASE_TWIST_RATE):
                q = 0.0
                for c in range(columns):
                    d_q[c] = 0.0
                power = 2 if base == BASE_TWIST else 3
                scaled = float(steps) ** power
                for i in range(n_real):
                    pole = real[0, i]
                    e = scaled * (pole - 1.0) ** power
                    q += e * x_real[i]
                    d_x = work[at_real + i]
                    for c in range(columns):
                        d_q[c] += e * d_x[c]
                    if c_real[0, i] >= 0:
                        d_q[c_real[0, i]] += scaled * power * (pole - 1.0) ** (power - 1) * x_real[i]
                for i in range(n_sections):
                    e1, e2, e1_by_a1, e2_by_a1, e1_by_a2, e2_by_a2 = own_difference(
                        sections[0, i], sections[1, i], power
                    )
                    q += scaled * (e1 * x1[i] + e2 * x2[i])
                    d_one, d_two = work[at_sections + 2 * i], work[at_sections + 2 * i + 1]
                    for c in range(columns):
                        d_q[c] += scaled * (e1 * d_one[c] + e2 * d_two[c])
                    if c_sections[0, i] >= 0:
                        d_q[c_sections[0, i]] += scaled * (e1_by_a1 * x1[i] + e2_by_a1 * x2[i])
                        d_q[c_sections[1, i]] += scaled * (e1_by_a2 * x1[i] + e2_by_a2 * x2[i])
            else:
                q = w
                for c in range(columns):
                    d_q[c] = d_w[c]
            for i in range(n_real):
                e = signal_real[j, i]
                if c_signal_real[j, i] >= 0 or e != 0.0:
                    q += e * x_real[i]
                    d_x = work[at_real + i]
                    for c in range(columns):
                        d_q[c] += e * d_x[c]
                    if c_signal_real[j, i] >= 0:
                        d_q[c_signal_real[j, i]] += x_real[i]
            for i in range(n_sections):
                e1, e2 = signal_sections[j, 0, i], signal_sections[j, 1, i]
                if c_signal_sections[j, 0, i] >= 0 or e1 != 0.0 or e2 != 0.0:
                    q += e1 * x1[i] + e2 * x2[i]
                    d_one, d_two = work[at_sections + 2 * i], work[at_sections + 2 * i + 1]
                    for c in range(columns):
                        d_q[c] += e1 * d_one[c] + e2 * d_two[c]
                    if c_signal_sections[j, 0, i] >= 0:
                        d_q[c_signal_sections[j, 0, i]] += x1[i]
                        d_q[c_signal_sections[j, 1, i]] += x2[i]
            t0, t1, t2 = thetas[j, 0], thetas[j, 1], thetas[j, 2]
            law, friction = laws[j], laws[j] in (COULOMB, STRIBECK) and base == BASE_SPEED
            by_w = by_z = by_own = 0.0
            if law == KNOWN:
                tau, by_q, g0, g1, g2 = forced[j, sample], 0.0, forced_by_lag[j, sample], 0.0, 0.0
            elif friction:
                own = direct[j, 0]
                for i in range(n_real):
                    own += port_real[j, i]
                for i in range(n_sections):
                    own += port_sections[j, 0, i]
                tau, by_q, by_own, g0, g1, g2 = held_back(q, own * steps, t0, t1, t2, law == STRIBECK)
                by_own *= steps
            else:
                tau, memory[j], by_q, by_w, g0, g1, g2, by_z = law_of(law, q, w, t0, t1, t2, memory[j], share)
            taus[j] = tau
            if at_sample:
                tau_out[j, sample], q_out[j, sample] = tau, q
            d_changed = d_z if law in (BRISTLE, SLIP) else d_tau
            for c in range(columns):
                d_changed[c] = by_z * d_changed[c] + by_q * d_q[c] + by_w * d_w[c]
            if c_thetas[j, 0] >= 0:
                d_changed[c_thetas[j, 0]] += g0
            if c_thetas[j, 1] >= 0:
                d_changed[c_thetas[j, 1]] += g1
            if c_thetas[j, 2] >= 0:
                d_changed[c_thetas[j, 2]] += g2
            if law in (BRISTLE, SLIP):
                by_z, g0 = torque_of_memory(law, memory[j], t0)
                for c in range(columns):
                    d_tau[c] = by_z * d_z[c]
                if c_thetas[j, 0] >= 0:
                    d_tau[c_thetas[j, 0]] += g0
            elif by_own != 0.0 and c_direct[j, 0] >= 0:
                d_tau[c_direct[j, 0]] += by_own
                for i in range(n_real):
                    d_tau[c_port_real[j, i]] += by_own
                for i in range(n_sections):
                    d_tau[c_port_sections[j, 0, i]] += by_own
        # The output.
        if has_play:
            play = outputs[PLAY]
            if out < w - play:
                out = w - play
                for c in range(columns):
                    d_out[c] = d_w[c]
                if c_outputs[PLAY] >= 0:
                    d_out[c_outputs[PLAY]] -= 1.0
            elif out > w + play:
                out = w + play
                for c in range(columns):
                    d_out[c] = d_w[c]
                if c_outputs[PLAY] >= 0:
                    d_out[c_outputs[PLAY]] += 1.0
        else:
            out = w
            for c in range(columns):
                d_out[c] = d_w[c]
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
                    outputs[SINE] * s
                    + outputs[COSINE] * (co - 1)
                    + outputs[SINE2] * s2
                    + outputs[COSINE2] * (co2 - 1)
                )
                turned = (
                    outputs[SINE] * co
                    - outputs[COSINE] * s
                    + 2 * outputs[SINE2] * co2
                    - 2 * outputs[COSINE2] * s2
                )
                slope_y += wave * turned
            y += outputs[RATE] * k
            if has_settling:
                decay = math.exp(-k / outputs[SETTLING_TIME])
                y += outputs[SETTLING] * (1 - decay)
            for c in range(columns):
                rows[c, sample] += slope_y * d_out[c]
            if columns > 0:
                if c_static[2] >= 0:
                    rows[c_static[2], sample] += by_half
                if c_outputs[LOG_RATIO] >= 0:
                    rows[c_outputs[LOG_RATIO], sample] += by_ratio
                if has_wave:
                    if c_outputs[SINE] >= 0:
                        rows[c_outputs[SINE], sample] += s
                        rows[c_outputs[COSINE], sample] += co - 1
                    if c_outputs[WAVENUMBER] >= 0:
                        rows[c_outputs[WAVENUMBER], sample] += out * turned
                    if c_outputs[SINE2] >= 0:
                        rows[c_outputs[SINE2], sample] += s2
                        rows[c_outputs[COSINE2], sample] += co2 - 1
                if c_outputs[RATE] >= 0:
                    rows[c_outputs[RATE], sample] += k
                if c_outputs[SETTLING] >= 0:
                    rows[c_outputs[SETTLING], sample] += 1 - decay
                if c_outputs[SETTLING_TIME] >= 0:
                    rows[c_outputs[SETTLING_TIME], sample] -= (
                        outputs[SETTLING] * decay * k / outputs[SETTLING_TIME] ** 2
                    )
            # What the encoder shows beyond that.
            for j in range(n_laws):
                if laws[j] != INNOVATION:
                    continue
                e = forced[j, sample] - y
                outside, direction = 1.0, 0.0
                if half_width > 0.0:
                    outside = min(max((abs(out) - half_width) / edge, 0.0), 1.0)
                    if 0.0 < outside < 1.0:
                        direction = 1.0 if out > 0.0 else -1.0
                trust = forced_by_lag[j, sample]
                taus[j] = trust * outside * e
                d_tau, by_out = work[at_tau + j], trust * direction * e / edge
                for c in range(columns):
                    d_tau[c] = by_out * d_out[c] - trust * outside * rows[c, sample]
                if c_static[2] >= 0:
                    d_tau[c_static[2]] -= trust * abs(direction) * e / edge
                tau_out[j, sample] = q_out[j, sample] = taus[j]
            w_out[sample], y_out[sample], slope_out[sample] = w, y, slope_y
            v_out[sample] = 0.0
        v_out[sample] += v * share
        # States and their tangents a sample on.
        for c in range(columns):
            d_w1[c] = d_w[c]
            d_i[c] += residue * d_v[c]
        if c_residue >= 0:
            d_i[c_residue] += v
        w1 = w
        integral += residue * v
        for i in range(n_real):
            pole, weight = real[0, i], real[1, i]
            d_x = work[at_real + i]
            for c in range(columns):
                d_x[c] = pole * d_x[c] + weight * d_v[c]
            if c_real[0, i] >= 0:
                d_x[c_real[0, i]] += x_real[i]
                d_x[c_real[1, i]] += v
            x = pole * x_real[i] + weight * v
            for j in range(n_laws):
                weight, d_tau = port_real[j, i], work[at_tau + j]
                x += weight * taus[j]
                for c in range(columns):
                    d_x[c] += weight * d_tau[c]
                if c_port_real[j, i] >= 0:
                    d_x[c_port_real[j, i]] += taus[j]
            x_real[i] = x
        for i in range(n_sections):
            a1, a2, b1, b2 = sections[0, i], sections[1, i], sections[2, i], sections[3, i]
            d_one, d_two = work[at_sections + 2 * i], work[at_sections + 2 * i + 1]
            for c in range(columns):
                one = d_one[c]
                d_one[c] = a1 * one + d_two[c] + b1 * d_v[c]
                d_two[c] = b2 * d_v[c] - a2 * one
            if c_sections[0, i] >= 0:
                d_one[c_sections[0, i]] += x1[i]
                d_two[c_sections[1, i]] -= x1[i]
                d_one[c_sections[2, i]] += v
                d_two[c_sections[3, i]] += v
            one = x1[i]
            x1[i] = a1 * one + x2[i] + b1 * v
            x2[i] = b2 * v - a2 * one
            for j in range(n_laws):
                w_1, w_2, d_tau = port_sections[j, 0, i], port_sections[j, 1, i], work[at_tau + j]
                x1[i] += w_1 * taus[j]
                x2[i] += w_2 * taus[j]
                for c in range(columns):
                    d_one[c] += w_1 * d_tau[c]
                    d_two[c] += w_2 * d_tau[c]
                if c_port_sections[j, 0, i] >= 0:
                    d_one[c_port_sections[j, 0, i]] += taus[j]
                    d_two[c_port_sections[j, 1, i]] += taus[j]
        for j in range(n_laws):
            weight, pole = direct[j, 0], direct[j, 1]
            d_x, d_tau = work[at_direct + j], work[at_tau + j]
            for c in range(columns):
                d_x[c] = pole * d_x[c] + weight * d_tau[c]
            if c_direct[j, 0] >= 0:
                d_x[c_direct[j, 0]] += taus[j]
                d_x[c_direct[j, 1]] += x_direct[j]
            x_direct[j] = pole * x_direct[j] + weight * taus[j]


@njit(cache=True, nogil=True, error_model="numpy")
def own_difference(a1, a2, power):  # type: ignore[no-untyped-def]
    """Weights of both states of a section in the difference of order 2 or 3 by which its output goes on by
    itself, and their derivatives by a1 and a2 in turn."""
    e1, e2 = (a1 - 1) ** 2 - a2, a1 - 2
    if power == 2:
        return e1, e2, 2 * (a1 - 1), 1.0, -1.0, 0.0
    return (
        e1 * (a1 - 1) - e2 * a2, e1 - e2,
        3 * (a1 - 1) ** 2 - 2 * a2, 2 * a1 - 3, 3 - 2 * a1, -1.0,
    )  # fmt: skip
