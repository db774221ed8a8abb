"""The states of a cascade with torques and what is linear in them: signals of laws, and what feeds tangents.

States in turn: real poles, both of every section, the direct path of every law, the integral, and w a step
before. *Carriers* are the states, the command v behind the input's effects, and the torque of every law.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled, compiled_inside, compiled_loop, pasted
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.model.lanes import LANES, broadcast, load, store

NOTHING = 1e-290
"""Of which sixteen digits are left off a number that fades."""


@compiled(nogil=True)
def entering(paths):  # type: ignore[no-untyped-def]
    """Weights (1 + laws, states) by which v and every torque enter the states."""
    real, sections, direct = paths.real, paths.sections, paths.direct
    n, m, laws = real.shape[1], sections.shape[1], len(direct)
    found = np.zeros((1 + laws, n + 2 * m + laws + 2))
    for i in range(n):
        found[0, i] = real[1, i]
    found[0, n + 2 * m + laws] = paths.residue
    for i in range(m):
        found[0, n + 2 * i], found[0, n + 2 * i + 1] = sections[2, i], sections[3, i]
    for j in range(laws):
        for i in range(n):
            found[1 + j, i] = paths.port_real[j, i]
        found[1 + j, n + 2 * m + j] = direct[j, 0]
        for i in range(m):
            found[1 + j, n + 2 * i] = paths.port_sections[j, 0, i]
            found[1 + j, n + 2 * i + 1] = paths.port_sections[j, 1, i]
    return found


@compiled(nogil=True)
def seen(paths, laws, steps):  # type: ignore[no-untyped-def]
    """Weights (1 + laws, states + 1) of the states, and of v, in w and in every law's signal."""
    real, sections, direct = paths.real, paths.sections, paths.direct
    n, m, count = real.shape[1], sections.shape[1], len(laws.law)
    states = n + 2 * m + count + 2
    found = np.zeros((1 + count, states + 1))
    for i in range(states - 1):
        found[0, i] = 1.0
    for i in range(m):
        found[0, n + 2 * i + 1] = 0.0
    for j in range(count):
        q = found[1 + j]
        if laws.base[j] == K.BASE_COMMAND:
            q[states] = 1.0
        elif laws.base[j] == K.BASE_SPEED and laws.law[j] in (K.COULOMB, K.STRIBECK):
            ahead = paths.residue
            for i in range(n):
                q[i] = steps * (real[0, i] - 1.0)
                ahead += real[1, i]
            for i in range(m):
                q[n + 2 * i], q[n + 2 * i + 1] = steps * (sections[0, i] - 1.0), steps
                ahead += sections[2, i]
            for i in range(count):
                q[n + 2 * m + i] = steps * (direct[i, 1] - 1.0)
            q[states] = steps * ahead
        elif laws.base[j] == K.BASE_SPEED:
            for i in range(states + 1):
                q[i] = steps * found[0, i]
            q[states - 1] = -steps
        elif laws.base[j] in (K.BASE_TWIST, K.BASE_TWIST_RATE):
            power = 2 if laws.base[j] == K.BASE_TWIST else 3
            scaled = float(steps) ** power
            for i in range(n):
                q[i] = scaled * (real[0, i] - 1.0) ** power
            for i in range(m):
                e1, e2, _, _, _, _ = own_difference(sections[0, i], sections[1, i], power)
                q[n + 2 * i], q[n + 2 * i + 1] = scaled * e1, scaled * e2
        elif laws.base[j] == K.BASE_MOTOR:
            for i in range(n):
                q[i] = 1.0
            q[states - 2] = 1.0
        else:
            for i in range(states + 1):
                q[i] = found[0, i]
        for i in range(n):
            q[i] += paths.signal_real[j, i]
        for i in range(m):
            q[n + 2 * i] += paths.signal_sections[j, 0, i]
            q[n + 2 * i + 1] += paths.signal_sections[j, 1, i]
    return found


@compiled_inside
def _present(where, weights, count):  # type: ignore[no-untyped-def]
    """The sources of the first `count` whose column is there, moved to the front."""
    found = 0
    for i in range(count):
        if where[1, i] >= 0:
            for row in range(3):
                where[row, found] = where[row, i]
            weights[found] = weights[i]
            found += 1
    return where[:, :found], weights[:found]


@compiled_inside
def state_sources(columns):  # type: ignore[no-untyped-def]
    """Where columns of tangents are fed: state, column and carrier (3, n), and signs (n,)."""
    n, m, laws = columns.real.shape[1], columns.sections.shape[1], len(columns.direct)
    states, at = n + 2 * m + laws + 2, 0
    where = np.empty((3, 1 + 2 * n + 4 * m + laws * (n + 2 * m + 2)), dtype=np.int64)
    signs = np.ones(where.shape[1])
    for i in range(n):
        where[0, at], where[0, at + 1] = i, i
        where[1, at], where[2, at] = columns.real[0, i], i
        where[1, at + 1], where[2, at + 1] = columns.real[1, i], states
        at += 2
    for i in range(m):
        one = n + 2 * i
        for k, carrier in enumerate((one, one, states, states)):
            where[0, at], where[1, at], where[2, at] = one + k % 2, columns.sections[k, i], carrier
            at += 1
        signs[at - 3] = -1.0
    for j in range(laws):
        for i in range(n):
            where[0, at], where[1, at], where[2, at] = i, columns.port_real[j, i], states + 1 + j
            at += 1
        for i in range(m):
            for k in range(2):
                where[0, at], where[1, at] = n + 2 * i + k, columns.port_sections[j, k, i]
                where[2, at] = states + 1 + j
                at += 1
        path = n + 2 * m + j
        where[0, at], where[0, at + 1] = path, path
        where[1, at], where[2, at] = columns.direct[j, 0], states + 1 + j
        where[1, at + 1], where[2, at + 1] = columns.direct[j, 1], path
        at += 2
    where[0, at], where[1, at], where[2, at] = states - 2, columns.residue, states
    return _present(where, signs, at + 1)


@compiled_inside
def signal_sources(paths, laws, steps, columns):  # type: ignore[no-untyped-def]
    """Which columns move a law's signal by themselves: law, column and carrier (3, n), and weights (n,)."""
    real, sections = paths.real, paths.sections
    n, m, count = real.shape[1], sections.shape[1], len(laws.law)
    states, at = n + 2 * m + count + 2, 0
    where = np.empty((3, count * (3 * n + 6 * m + count + 1)), dtype=np.int64)
    weights = np.empty(where.shape[1])
    for j in range(count):
        begin = at
        if laws.base[j] == K.BASE_SPEED and laws.law[j] in (K.COULOMB, K.STRIBECK):
            where[1, at], where[2, at], weights[at] = columns.residue, states, steps
            at += 1
            for i in range(n):
                where[1, at], where[2, at], weights[at] = columns.real[0, i], i, steps
                where[1, at + 1], where[2, at + 1], weights[at + 1] = columns.real[1, i], states, steps
                at += 2
            for i in range(m):
                where[1, at], where[2, at], weights[at] = columns.sections[0, i], n + 2 * i, steps
                where[1, at + 1], where[2, at + 1], weights[at + 1] = columns.sections[2, i], states, steps
                at += 2
            for i in range(count):
                where[1, at], where[2, at], weights[at] = columns.direct[i, 1], n + 2 * m + i, steps
                at += 1
        elif laws.base[j] in (K.BASE_TWIST, K.BASE_TWIST_RATE):
            power = 2 if laws.base[j] == K.BASE_TWIST else 3
            scaled = float(steps) ** power
            for i in range(n):
                where[1, at], where[2, at] = columns.real[0, i], i
                weights[at] = scaled * power * (real[0, i] - 1.0) ** (power - 1)
                at += 1
            for i in range(m):
                slopes = own_difference(sections[0, i], sections[1, i], power)
                for k in range(4):
                    where[1, at], where[2, at] = columns.sections[k // 2, i], n + 2 * i + k % 2
                    weights[at] = scaled * slopes[2 + k]
                    at += 1
        for i in range(n):
            where[1, at], where[2, at], weights[at] = columns.signal_real[j, i], i, 1.0
            at += 1
        for i in range(m):
            for k in range(2):
                where[1, at], where[2, at] = columns.signal_sections[j, k, i], n + 2 * i + k
                weights[at] = 1.0
                at += 1
        for i in range(begin, at):
            where[0, i] = j
    return _present(where, weights, at)


@pasted
def add(rows, row, lane, value, units):  # type: ignore[no-untyped-def]
    """Added to one number of a row that is read as a whole soon after: a processor waits for a number that
    was written by itself until it has left for the cache."""
    store(rows, row, load(rows, row) + load(units, lane) * broadcast(value))


@compiled_inside
def by_rows(where, weights, count):  # type: ignore[no-untyped-def]
    """Sources of tangents, `where` (3, n) as `state_sources` has them, by the rows of LANES columns that they
    act on, `count` rows a block: rows and where the sources of each begin (2, rows + 1); lane and carrier
    (2, n) of every source, and weights (n,), in that order."""
    row, order = np.empty(len(weights), np.int64), np.empty(len(weights), np.int64)
    for i in range(len(weights)):
        row[i] = where[1, i] // LANES * count + where[0, i]
        place = i
        while place > 0 and row[order[place - 1]] > row[i]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = i
    rows, found = np.zeros((2, len(row) + 1), dtype=np.uint64), 0
    sources, ordered = np.empty((2, len(row)), dtype=np.uint64), np.empty(len(row))
    for i in range(len(order)):
        if i == 0 or row[order[i]] != row[order[i - 1]]:
            rows[0, found], rows[1, found] = row[order[i]], i
            found += 1
        sources[0, i], sources[1, i] = where[1, order[i]] % LANES, where[2, order[i]]
        ordered[i] = weights[order[i]]
    rows[1, found] = len(row)
    return rows[:, : found + 1].copy(), sources, ordered


@compiled_loop
def add_sources(values, sources, carried, units, kept):  # type: ignore[no-untyped-def]
    """What the carriers bring, written to the rows that have sources (see `by_rows`), added to what stands
    there where that is `kept`."""
    rows, carriers, weights = sources
    for r in range(rows.shape[1] - 1):
        found = broadcast(0.0)
        if kept:
            found = load(values, rows[0, r])
        for i in range(rows[1, r], rows[1, r + 1]):
            found = found + load(units, carriers[0, i]) * broadcast(weights[i] * carried[carriers[1, i]])
        store(values, rows[0, r], found)


@compiled_inside
def own_columns(found, laws, columns):  # type: ignore[no-untyped-def]
    """Zeros `found` (blocks * laws, LANES) with a one for every weight by which a torque is part of w a step
    on."""
    n, m = columns.port_real.shape[1], columns.port_sections.shape[2]
    for j in range(laws):
        for i in range(1 + n + m):
            c = columns.direct[j, 0]
            if i > n:
                c = columns.port_sections[j, 0, i - 1 - n]
            elif i > 0:
                c = columns.port_real[j, i - 1]
            if c >= 0:
                found[c // LANES * laws + j, c % LANES] = 1.0
    return found


@pasted
def angle(motion):  # type: ignore[no-untyped-def]
    """w of the states."""
    w = 0.0
    for i in range(len(motion.entered) - 1):
        w += motion.looks[0, i] * motion.carried[i]
    return w


@pasted
def advance(paths, w, motion):  # type: ignore[no-untyped-def]
    """The states a step on."""
    real, sections, direct = paths.real, paths.sections, paths.direct
    carried, entered, enters, torques = motion.carried, motion.entered, motion.enters, motion.torques
    laws, n_real, states = len(torques), real.shape[1], len(entered)
    at_direct = states - 2 - laws
    for i in range(states):
        entered[i] = enters[0, i] * carried[states]
    for j in range(laws):
        for i in range(states):
            entered[i] += enters[1 + j, i] * torques[j]
    for i in range(n_real):
        carried[i] = real[0, i] * carried[i] + entered[i]
    for i in range(sections.shape[1]):
        at = n_real + 2 * i
        one = carried[at]
        carried[at] = sections[0, i] * one + carried[at + 1] + entered[at]
        carried[at + 1] = entered[at + 1] - sections[1, i] * one
    for j in range(laws):
        carried[at_direct + j] = direct[j, 1] * carried[at_direct + j] + entered[at_direct + j]
    carried[states - 2] += entered[states - 2]
    carried[states - 1] = w


@pasted
def faded(values):  # type: ignore[no-untyped-def]
    """Lanes, zero for numbers that are next to none: what fades by itself would end among numbers that a
    processor handles a hundred times as slowly."""
    return (values + broadcast(NOTHING)) - broadcast(NOTHING)


@compiled_loop
def advance_tangents(  # type: ignore[no-untyped-def]
    real, sections, direct, enters, looks, laws, d_state, fed, d_taus, d_v, drives, d_w, d_signals
):
    """Tangents of the states a step on with what is `fed` to them, and with that of v where that `drives`; of
    w and of the signals of the laws (all but an INNOVATION have one) from the states after it.

    Arrays hold blocks of LANES columns: of every block all states, or all laws, a row each.
    """
    n_laws, n_real, states = len(laws), real.shape[1], enters.shape[1]
    at_integral, at_direct = states - 2, states - 2 - n_laws
    # The first law that looks at anything; an INNOVATION alone has a row of zeros.
    first = 0
    for j in range(n_laws - 1, -1, -1):
        if laws[j] != K.INNOVATION:
            first = j
    one_law = min(1, n_laws)
    look = one_law * (1 + first)
    for block in range(len(d_w)):
        of_state, of_law = block * states, block * n_laws
        tau, v, seen = broadcast(0.0), load(d_v, block), broadcast(0.0)
        if n_laws > 0:
            tau = load(d_taus, of_law)
        w = load(d_state, of_state + at_integral) + load(fed, of_state + at_integral)
        if drives:
            w = w + broadcast(enters[0, at_integral]) * v
        store(d_state, of_state + at_integral, w)
        for j in range(n_laws):
            at = of_state + at_direct + j
            x = load(fed, at) + broadcast(direct[j, 1]) * load(d_state, at)
            x = faded(x + broadcast(direct[j, 0]) * load(d_taus, of_law + j))
            store(d_state, at, x)
            w = w + x
        for i in range(at_direct, states):
            if looks[look, i] != 0.0:
                seen = seen + broadcast(looks[look, i]) * load(d_state, of_state + i)
        for i in range(n_real):
            at = of_state + i
            x = (
                load(fed, at)
                + broadcast(real[0, i]) * load(d_state, at)
                + broadcast(enters[one_law, i]) * tau
            )
            for j in range(1, n_laws):
                x = x + broadcast(enters[1 + j, i]) * load(d_taus, of_law + j)
            if drives:
                x = x + broadcast(enters[0, i]) * v
            x = faded(x)
            store(d_state, at, x)
            w = w + x
            seen = seen + broadcast(looks[look, i]) * x
        for i in range(sections.shape[1]):
            one_at, two_at = n_real + 2 * i, n_real + 2 * i + 1
            at, after = of_state + one_at, of_state + two_at
            one, two = load(d_state, at), load(d_state, after)
            x = (
                two
                + load(fed, at)
                + broadcast(sections[0, i]) * one
                + broadcast(enters[one_law, one_at]) * tau
            )
            z = load(fed, after) - broadcast(sections[1, i]) * one + broadcast(enters[one_law, two_at]) * tau
            for j in range(1, n_laws):
                more = load(d_taus, of_law + j)
                x = x + broadcast(enters[1 + j, one_at]) * more
                z = z + broadcast(enters[1 + j, two_at]) * more
            if drives:
                x = x + broadcast(enters[0, one_at]) * v
                z = z + broadcast(enters[0, two_at]) * v
            x, z = faded(x), faded(z)
            store(d_state, at, x)
            store(d_state, after, z)
            w = w + x
            seen = seen + broadcast(looks[look, one_at]) * x + broadcast(looks[look, two_at]) * z
        store(d_w, block, w)
        if n_laws > 0:
            store(d_signals, of_law + first, seen)
        for j in range(first + 1, n_laws):
            if laws[j] != K.INNOVATION:
                seen = broadcast(0.0)
                for i in range(states):
                    if looks[1 + j, i] != 0.0:
                        seen = seen + broadcast(looks[1 + j, i]) * load(d_state, of_state + i)
                store(d_signals, of_law + j, seen)


@compiled_inside
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
