"""The states of a cascade with torques and what is linear in them: signals of laws, and what feeds tangents.

States in turn: real poles, both of every section, the direct path of every law, the integral, and w a step
before. *Carriers* are the states, the command v behind the input's effects, and the torque of every law.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812


@njit(cache=True, nogil=True, error_model="numpy")
def entering(residue, real, sections, port_real, port_sections, direct):  # type: ignore[no-untyped-def]
    """Weights (1 + laws, states) by which v and every torque enter the states; numbers as
    `joint_kernel.respond_jointly` has them."""
    n, m, laws = real.shape[1], sections.shape[1], len(direct)
    found = np.zeros((1 + laws, n + 2 * m + laws + 2))
    for i in range(n):
        found[0, i] = real[1, i]
    found[0, n + 2 * m + laws] = residue
    for i in range(m):
        found[0, n + 2 * i], found[0, n + 2 * i + 1] = sections[2, i], sections[3, i]
    for j in range(laws):
        for i in range(n):
            found[1 + j, i] = port_real[j, i]
        found[1 + j, n + 2 * m + j] = direct[j, 0]
        for i in range(m):
            found[1 + j, n + 2 * i] = port_sections[j, 0, i]
            found[1 + j, n + 2 * i + 1] = port_sections[j, 1, i]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def seen(residue, real, sections, laws, bases, direct, signal_real, signal_sections, steps):  # type: ignore[no-untyped-def]
    """Weights (1 + laws, states + 1) of the states, and of v, in w and in every law's signal."""
    n, m, count = real.shape[1], sections.shape[1], len(laws)
    states = n + 2 * m + count + 2
    found = np.zeros((1 + count, states + 1))
    found[0, : states - 2] = 1.0
    found[0, states - 2] = 1.0
    for i in range(m):
        found[0, n + 2 * i + 1] = 0.0
    for j in range(count):
        q = found[1 + j]
        if bases[j] == K.BASE_COMMAND:
            q[states] = 1.0
        elif bases[j] == K.BASE_SPEED and laws[j] in (K.COULOMB, K.STRIBECK):
            ahead = residue
            for i in range(n):
                q[i] = steps * (real[0, i] - 1.0)
                ahead += real[1, i]
            for i in range(m):
                q[n + 2 * i], q[n + 2 * i + 1] = steps * (sections[0, i] - 1.0), steps
                ahead += sections[2, i]
            for i in range(count):
                q[n + 2 * m + i] = steps * (direct[i, 1] - 1.0)
            q[states] = steps * ahead
        elif bases[j] == K.BASE_SPEED:
            for i in range(states + 1):
                q[i] = steps * found[0, i]
            q[states - 1] = -steps
        elif bases[j] in (K.BASE_TWIST, K.BASE_TWIST_RATE):
            power = 2 if bases[j] == K.BASE_TWIST else 3
            scaled = float(steps) ** power
            for i in range(n):
                q[i] = scaled * (real[0, i] - 1.0) ** power
            for i in range(m):
                e1, e2, _, _, _, _ = own_difference(sections[0, i], sections[1, i], power)
                q[n + 2 * i], q[n + 2 * i + 1] = scaled * e1, scaled * e2
        elif bases[j] == K.BASE_MOTOR:
            q[:n] = 1.0
            q[states - 2] = 1.0
        else:
            for i in range(states + 1):
                q[i] = found[0, i]
        for i in range(n):
            q[i] += signal_real[j, i]
        for i in range(m):
            q[n + 2 * i] += signal_sections[j, 0, i]
            q[n + 2 * i + 1] += signal_sections[j, 1, i]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def state_sources(c_residue, c_real, c_sections, c_port_real, c_port_sections, c_direct):  # type: ignore[no-untyped-def]
    """Where columns of tangents are fed: state, column and carrier (3, n), and signs (n,)."""
    n, m, laws = c_real.shape[1], c_sections.shape[1], len(c_direct)
    states, at = n + 2 * m + laws + 2, 0
    where = np.empty((3, 1 + 2 * n + 4 * m + laws * (n + 2 * m + 2)), dtype=np.int64)
    signs = np.ones(where.shape[1])
    for i in range(n):
        where[0, at : at + 2] = i
        where[1, at], where[2, at] = c_real[0, i], i
        where[1, at + 1], where[2, at + 1] = c_real[1, i], states
        at += 2
    for i in range(m):
        one = n + 2 * i
        for k, carrier in enumerate((one, one, states, states)):
            where[0, at], where[1, at], where[2, at] = one + k % 2, c_sections[k, i], carrier
            at += 1
        signs[at - 3] = -1.0
    for j in range(laws):
        for i in range(n):
            where[0, at], where[1, at], where[2, at] = i, c_port_real[j, i], states + 1 + j
            at += 1
        for i in range(m):
            for k in range(2):
                where[0, at], where[1, at] = n + 2 * i + k, c_port_sections[j, k, i]
                where[2, at] = states + 1 + j
                at += 1
        path = n + 2 * m + j
        where[0, at : at + 2] = path
        where[1, at], where[2, at] = c_direct[j, 0], states + 1 + j
        where[1, at + 1], where[2, at + 1] = c_direct[j, 1], path
        at += 2
    where[0, at], where[1, at], where[2, at] = states - 2, c_residue, states
    present = where[1] >= 0
    return where[:, present], signs[present]


@njit(cache=True, nogil=True, error_model="numpy")
def signal_sources(  # type: ignore[no-untyped-def]
    real, sections, laws, bases, steps, c_residue, c_real, c_sections, c_direct, c_signal_real,
    c_signal_sections,
):  # fmt: skip
    """Which columns move a law's signal by themselves: law, column and carrier (3, n), and weights (n,)."""
    n, m, count = real.shape[1], sections.shape[1], len(laws)
    states, at = n + 2 * m + count + 2, 0
    where = np.empty((3, count * (3 * n + 6 * m + count + 1)), dtype=np.int64)
    weights = np.empty(where.shape[1])
    for j in range(count):
        begin = at
        if bases[j] == K.BASE_SPEED and laws[j] in (K.COULOMB, K.STRIBECK):
            where[1, at], where[2, at], weights[at] = c_residue, states, steps
            at += 1
            for i in range(n):
                where[1, at], where[2, at], weights[at] = c_real[0, i], i, steps
                where[1, at + 1], where[2, at + 1], weights[at + 1] = c_real[1, i], states, steps
                at += 2
            for i in range(m):
                where[1, at], where[2, at], weights[at] = c_sections[0, i], n + 2 * i, steps
                where[1, at + 1], where[2, at + 1], weights[at + 1] = c_sections[2, i], states, steps
                at += 2
            for i in range(count):
                where[1, at], where[2, at], weights[at] = c_direct[i, 1], n + 2 * m + i, steps
                at += 1
        elif bases[j] in (K.BASE_TWIST, K.BASE_TWIST_RATE):
            power = 2 if bases[j] == K.BASE_TWIST else 3
            scaled = float(steps) ** power
            for i in range(n):
                where[1, at], where[2, at] = c_real[0, i], i
                weights[at] = scaled * power * (real[0, i] - 1.0) ** (power - 1)
                at += 1
            for i in range(m):
                slopes = own_difference(sections[0, i], sections[1, i], power)
                for k in range(4):
                    where[1, at], where[2, at] = c_sections[k // 2, i], n + 2 * i + k % 2
                    weights[at] = scaled * slopes[2 + k]
                    at += 1
        for i in range(n):
            where[1, at], where[2, at], weights[at] = c_signal_real[j, i], i, 1.0
            at += 1
        for i in range(m):
            for k in range(2):
                where[1, at], where[2, at] = c_signal_sections[j, k, i], n + 2 * i + k
                weights[at] = 1.0
                at += 1
        where[0, begin:at] = j
    where, weights = where[:, :at], weights[:at]
    present = where[1] >= 0
    return where[:, present], weights[present]


@njit(cache=True, nogil=True, error_model="numpy")
def advance_tangents(  # type: ignore[no-untyped-def]
    real, sections, direct, enters, looks, laws, d_state, d_taus, d_w, d_signals, at_direct
):
    """Tangents of the states a step on, without what feeds them and what v does; of w and of the signals of
    the laws (all but an K.INNOVATION have one) from the states after it."""
    n_laws, padded, n_real = len(laws), d_state.shape[1], real.shape[1]
    at_integral, at_before = at_direct + n_laws, at_direct + n_laws + 1
    for c in range(padded):
        d_w[c] = d_state[at_integral, c]
    for j in range(n_laws):
        at, pole, weight = at_direct + j, direct[j, 1], direct[j, 0]
        for c in range(padded):
            x = pole * d_state[at, c] + weight * d_taus[j, c]
            d_state[at, c] = x
            d_w[c] += x
    # The first law that looks at anything; an K.INNOVATION alone has a row of zeros.
    first, last = 0, n_laws - 1
    for j in range(n_laws - 1, -1, -1):
        if laws[j] != K.INNOVATION:
            first = j
    for j in range(n_laws):
        if laws[j] == K.INNOVATION:
            continue
        of_integral, of_before = looks[1 + j, at_integral], looks[1 + j, at_before]
        for c in range(padded):
            d_signals[j, c] = of_integral * d_state[at_integral, c] + of_before * d_state[at_before, c]
        for i in range(n_laws):
            at, weight = at_direct + i, looks[1 + j, at_direct + i]
            if weight != 0.0:
                for c in range(padded):
                    d_signals[j, c] += weight * d_state[at, c]
    for i in range(n_real):
        pole = real[0, i]
        for c in range(padded):
            d_state[i, c] *= pole
        for j in range(n_laws):
            weight = enters[1 + j, i]
            for c in range(padded):
                d_state[i, c] += weight * d_taus[j, c]
        for c in range(padded):
            d_w[c] += d_state[i, c]
        for j in range(n_laws):
            weight = looks[1 + j, i]
            if weight != 0.0:
                for c in range(padded):
                    d_signals[j, c] += weight * d_state[i, c]
    for i in range(sections.shape[1]):
        at, after = n_real + 2 * i, n_real + 2 * i + 1
        a1, a2 = sections[0, i], sections[1, i]
        if n_laws == 0:
            for c in range(padded):
                one = d_state[at, c]
                x = a1 * one + d_state[after, c]
                d_state[at, c], d_state[after, c] = x, -a2 * one
                d_w[c] += x
            continue
        e_1, e_2 = looks[1 + first, at], looks[1 + first, after]
        if n_laws <= 2:
            w_1, w_2, more_1, more_2 = enters[1, at], enters[1, after], 0.0, 0.0
            if n_laws == 2:
                more_1, more_2 = enters[2, at], enters[2, after]
            for c in range(padded):
                one, tau, more = d_state[at, c], d_taus[0, c], d_taus[last, c]
                x = a1 * one + d_state[after, c] + w_1 * tau + more_1 * more
                z = w_2 * tau + more_2 * more - a2 * one
                d_state[at, c], d_state[after, c] = x, z
                d_w[c] += x
                d_signals[first, c] += e_1 * x + e_2 * z
        else:
            for c in range(padded):
                one = d_state[at, c]
                d_state[at, c] = a1 * one + d_state[after, c]
                d_state[after, c] = -a2 * one
            for j in range(n_laws):
                w_1, w_2 = enters[1 + j, at], enters[1 + j, after]
                for c in range(padded):
                    tau = d_taus[j, c]
                    d_state[at, c] += w_1 * tau
                    d_state[after, c] += w_2 * tau
            for c in range(padded):
                d_w[c] += d_state[at, c]
                d_signals[first, c] += e_1 * d_state[at, c] + e_2 * d_state[after, c]
        for j in range(first + 1, n_laws):
            e_1, e_2 = looks[1 + j, at], looks[1 + j, after]
            if laws[j] != K.INNOVATION and (e_1 != 0.0 or e_2 != 0.0):
                for c in range(padded):
                    d_signals[j, c] += e_1 * d_state[at, c] + e_2 * d_state[after, c]


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
