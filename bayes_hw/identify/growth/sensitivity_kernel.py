"""Compiled response of a cascade and its derivatives with respect to every parameter.

Sections and poles as in `bayes_hw.identify.cascade`:

    s(k) = v(k) + a1 s(k-1) - a2 s(k-2),    w_s(k) = b1 s(k-1) + b2 s(k-2),
    r(k) = p r(k-1) + c v(k-1).

With A = 1 - a1 q + a2 q^2 (q the unit delay) d w_s / d a1 = q w_s / A, d w_s / d a2 = -q^2 w_s / A,
d w_s / d b_i = q^i v / A, and a limit of v acts through the same filters on the samples that it clips.
"""

from __future__ import annotations

from bayes_hw.compiled import compiled

WHITENED_AT_ONCE = 512
"""Samples of a row, which are whitened by all coefficients before the next."""


@compiled(nogil=True)
def integrate(v, below, above, residue, state, w, to_lower, to_upper, to_residue):  # type: ignore[no-untyped-def]
    """w += residue times the running sum of v up to the sample before; `state` (4,): sums of v, of the
    samples below and above the limits, and the part of w before the first sample."""
    total, low, high, start = state
    for k in range(len(v)):
        w[k] += residue * total + start
        to_residue[k] = total
        to_lower[k] += residue * low
        to_upper[k] += residue * high
        total += v[k]
        low += below[k]
        high += above[k]
    state[0], state[1], state[2] = total, low, high


@compiled(nogil=True)
def first_order(  # type: ignore[no-untyped-def]
    v, below, above, pole, residue, slope, state, w, to_lower, to_upper, to_pole, to_residue
):
    """A first-order part of w, from rest; `slope` is d pole / d coordinate, `state` (4,) the filtered v,
    below, above and w of this part."""
    x, low, high, z = state
    for k in range(len(v)):
        part = residue * x
        w[k] += part
        to_residue[k] = x
        to_lower[k] += residue * low
        to_upper[k] += residue * high
        to_pole[k] = slope * z
        x = v[k] + pole * x
        low = below[k] + pole * low
        high = above[k] + pole * high
        z = part + pole * z
    state[0], state[1], state[2], state[3] = x, low, high, z


@compiled(nogil=True)
def second_order(  # type: ignore[no-untyped-def]
    v, below, above, section, slopes, state, w, to_lower, to_upper, to_first, to_second, to_b1, to_b2
):
    """A second-order part of w, from rest; `section` (4,): a1, a2, b1, b2; `slopes` (3,): d a1 / d first
    coordinate, d a1 and d a2 / d second one; `state` (8,): s(k-1), s(k-2) of v, below, above and the part."""
    a1, a2, b1, b2 = section
    x1, x2, l1, l2, h1, h2, z1, z2 = state
    for k in range(len(v)):
        part = b1 * x1 + b2 * x2
        w[k] += part
        to_b1[k], to_b2[k] = x1, x2
        to_lower[k] += b1 * l1 + b2 * l2
        to_upper[k] += b1 * h1 + b2 * h2
        to_first[k] = slopes[0] * z1
        to_second[k] = slopes[1] * z1 - slopes[2] * z2
        x1, x2 = v[k] + a1 * x1 - a2 * x2, x1
        l1, l2 = below[k] + a1 * l1 - a2 * l2, l1
        h1, h2 = above[k] + a1 * h1 - a2 * h2, h1
        z1, z2 = part + a1 * z1 - a2 * z2, z1
    state[:] = x1, x2, l1, l2, h1, h2, z1, z2


@compiled(nogil=True)
def free_first_order(pole, start, slope, state, w, to_pole, to_start):  # type: ignore[no-untyped-def]
    """The free response of a first-order part, begun at `start`; `state` (2,): that of a unit start and its
    derivative by the pole at the next sample."""
    unit, turned = state
    for k in range(len(w)):
        w[k] += start * unit
        to_start[k] = unit
        to_pole[k] += slope * start * turned
        turned = unit + pole * turned
        unit *= pole
    state[:] = unit, turned


@compiled(nogil=True)
def free_second_order(  # type: ignore[no-untyped-def]
    section, slopes, starts, state, w, to_first, to_second, to_start, to_next
):
    """The free response of a second-order part that begins with `starts` (2,), its first sample and the step
    to its second: two samples of a slow one would be all but the same. `state` (8,): the next two samples of
    the responses to unit starts, and of the derivatives by a1 and a2."""
    a1, a2 = section[0], section[1]
    g0, g1, h0, h1, d0, d1, e0, e1 = state
    for k in range(len(w)):
        now, after = starts[0] * g0 + starts[1] * h0, starts[0] * g1 + starts[1] * h1
        w[k] += now
        to_start[k], to_next[k] = g0, h0
        to_first[k] += slopes[0] * d0
        to_second[k] += slopes[1] * d0 + slopes[2] * e0
        g0, g1 = g1, a1 * g1 - a2 * g0
        h0, h1 = h1, a1 * h1 - a2 * h0
        d0, d1 = d1, a1 * d1 - a2 * d0 + after
        e0, e1 = e1, a1 * e1 - a2 * e0 - now
    state[:] = g0, g1, h0, h1, d0, d1, e0, e1


@compiled(nogil=True)
def respond(v, residue, real, sections, starts, w):  # type: ignore[no-untyped-def]
    """w alone: `real` (2, n): poles and residues; `sections` (4, n); `starts`: what integrator, real poles
    and sections begin with as in the functions above, or nothing."""
    total = 0.0
    for k in range(len(v)):
        w[k] = residue * total
        total += v[k]
    for i in range(real.shape[1]):
        pole, weight, x = real[0, i], real[1, i], 0.0
        for k in range(len(v)):
            w[k] += weight * x
            x = v[k] + pole * x
    for i in range(sections.shape[1]):
        a1, a2, b1, b2 = sections[:, i]
        x1 = x2 = 0.0
        for k in range(len(v)):
            w[k] += b1 * x1 + b2 * x2
            x1, x2 = v[k] + a1 * x1 - a2 * x2, x1
    if not len(starts):
        return
    at = len(starts) - real.shape[1] - 2 * sections.shape[1]
    for i in range(at):
        w += starts[i]
    for i in range(real.shape[1]):
        free = starts[at + i]
        for k in range(len(v)):
            w[k] += free
            free *= real[0, i]
    at += real.shape[1]
    for i in range(sections.shape[1]):
        a1, a2, free, after = sections[0, i], sections[1, i], starts[at + 2 * i], starts[at + 2 * i]
        after += starts[at + 2 * i + 1]
        for k in range(len(v)):
            w[k] += free
            free, after = after, a1 * after - a2 * free


@compiled(nogil=True)
def filtered_pair(v, a1, a2, once, twice):  # type: ignore[no-untyped-def]
    """s(k-1) and s(k-2) of one second-order denominator, from rest."""
    x1 = x2 = 0.0
    for k in range(len(v)):
        once[k], twice[k] = x1, x2
        x1, x2 = v[k] + a1 * x1 - a2 * x2, x1


@compiled(nogil=True)
def filtered_pole(v, pole, once):  # type: ignore[no-untyped-def]
    """r(k) of one real pole with unit residue, from rest."""
    x = 0.0
    for k in range(len(v)):
        once[k] = x
        x = v[k] + pole * x


@compiled(nogil=True, fastmath={"contract"})
def whiten(rows, first, coefficients, scales, result):  # type: ignore[no-untyped-def]
    """Innovations of every row of `rows` (n, samples) from sample `first` on, `result` (n, samples - first).

    `coefficients` (p + 1, p) holds the predictors of all orders up to p and `scales` (p + 1,) what their
    innovations are divided by: before p samples have passed the predictor of that order is taken, which makes
    the likelihood exact. `first` is 0 at the start of a record, at least p later. A row is gone through by
    blocks that stay in the nearest cache, eight coefficients at a time.
    """
    order, length = len(scales) - 1, rows.shape[1]
    eights = order - order % 8
    for c in range(rows.shape[0]):
        row, out = rows[c], result[c]
        begin = first
        while begin < min(order, length):
            value = row[begin]
            for i in range(begin):
                value -= coefficients[begin, i] * row[begin - 1 - i]
            out[begin - first] = value / scales[begin]
            begin += 1
        while begin < length:
            end = min(begin + WHITENED_AT_ONCE, length)
            block = out[begin - first : end - first]
            for k in range(end - begin):
                block[k] = row[begin + k]
            for i in range(0, eights, 8):
                p0, p1 = coefficients[order, i], coefficients[order, i + 1]
                p2, p3 = coefficients[order, i + 2], coefficients[order, i + 3]
                p4, p5 = coefficients[order, i + 4], coefficients[order, i + 5]
                p6, p7 = coefficients[order, i + 6], coefficients[order, i + 7]
                past = row[begin - 8 - i : end]
                for k in range(len(block)):
                    near = (p0 * past[k + 7] + p1 * past[k + 6]) + (p2 * past[k + 5] + p3 * past[k + 4])
                    far = (p4 * past[k + 3] + p5 * past[k + 2]) + (p6 * past[k + 1] + p7 * past[k])
                    block[k] -= near + far
            for i in range(eights, order):
                phi, past = coefficients[order, i], row[begin - 1 - i : end]
                for k in range(len(block)):
                    block[k] -= phi * past[k]
            begin = end


@compiled(nogil=True)
def gate(w, half_width, rows):  # type: ignore[no-untyped-def]
    """Rows of derivatives of w (n, samples) become those of y, in place: nothing passes a dead zone."""
    for c in range(rows.shape[0]):
        row = rows[c]
        for k in range(len(w)):
            if abs(w[k]) <= half_width:
                row[k] = 0.0
