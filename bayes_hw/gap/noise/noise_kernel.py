"""Compiled filters of the noise that is not stationary: clock jitter, held samples, noise with a state."""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled, compiled_inside
from bayes_hw.gap.simulate.signal_kernel import behind_dead_zone
from bayes_hw.model.lane_functions import absolute
from bayes_hw.model.lanes import LANES, aligned_rows, broadcast, load, maximum, store

LOG_2PI = np.log(2 * np.pi)

SETTLED = 1e-7
"""Relative change of the state's variance in a sample below which the gain is kept."""

SETTLED_AGAIN = 1e-4
"""The same once the output has changed: it will change again."""


@compiled(nogil=True)
def jitter_filter(columns, coefficient, innovation_variance, extra_variance, white):  # type: ignore[no-untyped-def]
    """Kalman filter of first-order noise plus white noise of known, changing variance; the log-determinant.

    n(k) = coefficient n(k-1) + a(k), e(k) = n(k) + r(k) with var a = innovation_variance and
    var r(k) = extra_variance[k], infinite where there is no reading.
    `columns` (samples, m) are filtered with the same gains into `white`.
    """
    samples, m = columns.shape
    state = np.zeros(m)
    variance = innovation_variance / (1 - coefficient**2)
    log_determinant = 0.0
    for k in range(samples):
        total = variance + extra_variance[k]
        gain = variance / total
        root = np.sqrt(total)
        if total < np.inf:
            log_determinant += np.log(total)
        for j in range(m):
            innovation = columns[k, j] - state[j]
            white[k, j] = innovation / root
            state[j] = coefficient * (state[j] + gain * innovation)
        variance = coefficient**2 * variance * (1 - gain) + innovation_variance
    return log_determinant


@compiled(nogil=True)
def held_ages(y, simulated, hold, coefficient, innovation_sigma, ages):  # type: ignore[no-untyped-def]
    """Forward filter over the age of a displayed sample; the log-likelihood.

    The encoder shows simulated[k - a] with a = 0 when it is fresh and one more than before when it repeats,
    which it does with probability `hold`; first-order noise is added. `ages` (samples, largest age + 1) gets
    the filtered probabilities.
    """
    samples, count = ages.shape
    log_likelihood = 0.0
    norm = -np.log(innovation_sigma) - 0.5 * LOG_2PI
    before = np.zeros(count)
    before[0] = 1.0
    joint = np.zeros(count)
    for k in range(samples):
        largest = -np.inf
        fresh = -np.inf
        for a in range(count):
            joint[a] = -np.inf
        for a in range(count):
            if before[a] <= 0:
                continue
            earlier = 0.0 if k == 0 else y[k - 1] - simulated[max(k - 1 - a, 0)]
            log_before = np.log(before[a])
            e = (y[k] - simulated[k] - coefficient * earlier) / innovation_sigma
            value = log_before + np.log(1 - hold) - 0.5 * e * e
            top = max(fresh, value)
            fresh = top + np.log(np.exp(fresh - top) + np.exp(value - top))
            if a + 1 < count and k > a:
                e = (y[k] - simulated[k - a - 1] - coefficient * earlier) / innovation_sigma
                joint[a + 1] = log_before + np.log(hold) - 0.5 * e * e
        joint[0] = fresh
        for a in range(count):
            largest = max(largest, joint[a])
        total = 0.0
        for a in range(count):
            before[a] = np.exp(joint[a] - largest)
            total += before[a]
        for a in range(count):
            before[a] /= total
            ages[k, a] = before[a]
        log_likelihood += largest + np.log(total) + norm
    return log_likelihood


@compiled(nogil=True)
def state_gains(  # type: ignore[no-untyped-def]
    transition, output, share, doubt, strength, increment, initial, gains, roots, variances
):
    """Gains of the Kalman filter of noise with a state; the log-determinant of the innovations' variances.

    x(k+1) = transition x(k) + a(k) with var a = increment (n, n), of all but the last state times `strength`
    (samples,), x(0) of variance `initial`; e(k) = output x(k), of all but its last term the `share`
    (samples,) that shows, and noise of variance `doubt` (samples,), infinite where there is no reading.
    Fills `gains` (samples, n), `roots` (samples,) with the innovations' standard deviations and `variances`
    (samples,) with how uncertain output x(k) without its last term is, given the samples before. The gain is
    kept once it no longer changes.

    The rows of matrices are values of LANES numbers, `wide` of them a row.
    """
    samples, n = len(share), len(output)
    wide = (n + LANES - 1) // LANES
    variance, increments, transposed = _rows(initial, wide), _rows(increment, wide), _rows(transition.T, wide)
    carried, following = aligned_rows(n * wide), aligned_rows(n * wide)
    towards, column, row, per_spread = _zeros(wide), _zeros(wide), _zeros(wide), _zeros(wide)
    flat_towards, flat_column, flat_row = towards.reshape(-1), column.reshape(-1), row.reshape(-1)
    flat_per_spread, flat_variance, flat_following = (
        per_spread.reshape(-1),
        variance.reshape(-1),
        following.reshape(-1),
    )
    across = wide * LANES
    gain = np.zeros(n)
    first, place, value_of = _non_zero(transition)
    settled, limit = False, SETTLED
    total, root, log_total, uncertain = 1.0, 1.0, 0.0, 0.0
    log_determinant = 0.0
    for k in range(samples):
        changed = k == 0 or share[k] != share[k - 1] or strength[k] != strength[k - 1]
        if doubt[k] > 0 or (k > 0 and (changed or doubt[k - 1] > 0)):
            settled, limit = False, SETTLED_AGAIN
        if not settled:
            for c in range(wide):
                value = broadcast(0.0)
                for j in range(n - 1):
                    value = value + broadcast(output[j]) * load(variance, j * wide + c)
                store(towards, c, value)
                own = broadcast(output[n - 1]) * load(variance, (n - 1) * wide + c)
                store(column, c, broadcast(share[k]) * value + own)
            uncertain, total = 0.0, doubt[k] + output[n - 1] * flat_column[n - 1]
            for i in range(n - 1):
                uncertain += output[i] * flat_towards[i]
                total += share[k] * output[i] * flat_column[i]
            total = max(total, 1e-300)
            root, log_total = np.sqrt(total), np.log(total) if total < np.inf else 0.0
            per_total = 1 / total
            for i in range(n):
                gain[i] = flat_column[i] * per_total
                for c in range(wide):
                    taken = broadcast(gain[i]) * load(column, c)
                    store(carried, i * wide + c, load(variance, i * wide + c) - taken)
            for i in range(n):
                for c in range(wide):
                    value = broadcast(0.0)
                    for p in range(first[i], first[i + 1]):
                        value = value + broadcast(value_of[p]) * load(carried, place[p] * wide + c)
                    store(row, c, value)
                times = strength[k] if i < n - 1 else 1.0
                for c in range(wide):
                    value = broadcast(times) * load(increments, i * wide + c)
                    for b in range(n):
                        value = value + broadcast(flat_row[b]) * load(transposed, b * wide + c)
                    store(following, i * wide + c, value)
                flat_per_spread[i] = 1 / (np.sqrt(abs(flat_following[i * across + i])) + 1e-150)
            for c in range(wide):
                largest = broadcast(0.0)
                for i in range(n):
                    new = load(following, i * wide + c)
                    change = absolute(new - load(variance, i * wide + c))
                    largest = maximum(largest, change * (broadcast(flat_per_spread[i]) * load(per_spread, c)))
                    store(variance, i * wide + c, new)
                store(row, c, largest)
            for i in range(n):
                for j in range(i):
                    flat_variance[j * across + i] = flat_variance[i * across + j]
            settled = flat_row.max() < limit and k > n
        log_determinant += log_total
        variances[k], roots[k] = uncertain, root
        for i in range(n):
            gains[k, i] = gain[i]
    return log_determinant


@compiled(nogil=True)
def state_filter(columns, transition, output, share, gains, roots, white, expected):  # type: ignore[no-untyped-def]
    """Kalman filter of noise with a state, by the `gains` and `roots` that `state_gains` finds.

    `columns` (samples, lanes), one or whole groups of LANES, are filtered into `white`,
    unit innovations where they are such noise, zero without a reading;
    `expected` (samples, lanes) is what the samples before let expect of output x(k) without its last term.
    """
    samples, n = len(columns), len(output)
    alone, groups = columns.shape[1] == 1, columns.shape[1] // LANES
    single, moved = np.zeros(n), np.zeros(n)
    state, corrected = _zeros(n * groups), aligned_rows(n)
    first, place, value_of = _non_zero(transition)
    for k in range(samples):
        if alone:
            disturbance = 0.0
            for i in range(n - 1):
                disturbance += output[i] * single[i]
            expected[k, 0] = disturbance
            innovation = columns[k, 0] - output[n - 1] * single[n - 1] - share[k] * disturbance
            white[k, 0] = innovation / roots[k]
            for i in range(n):
                moved[i] = single[i] + gains[k, i] * innovation
            for i in range(n):
                single[i] = 0.0
                for p in range(first[i], first[i + 1]):
                    single[i] += value_of[p] * moved[place[p]]
        for group in range(groups):
            at = k * groups + group
            disturbance = broadcast(0.0)
            for i in range(n - 1):
                disturbance = disturbance + broadcast(output[i]) * load(state, i * groups + group)
            store(expected, at, disturbance)
            own = broadcast(output[n - 1]) * load(state, (n - 1) * groups + group)
            innovation = load(columns, at) - own - broadcast(share[k]) * disturbance
            store(white, at, innovation * broadcast(1 / roots[k]))
            for i in range(n):
                store(corrected, i, load(state, i * groups + group) + broadcast(gains[k, i]) * innovation)
            for i in range(n):
                value = broadcast(0.0)
                for p in range(first[i], first[i + 1]):
                    value = value + broadcast(value_of[p]) * load(corrected, place[p])
                store(state, i * groups + group, value)


@compiled_inside
def _non_zero(matrix):  # type: ignore[no-untyped-def]
    """Of every row where its terms other than zero begin (rows + 1,), their columns and values (terms,)."""
    n = len(matrix)
    first = np.zeros(n + 1, np.int64)
    place, value = np.empty(n * n, np.int64), np.empty(n * n)
    for i in range(n):
        count = first[i]
        for j in range(n):
            if matrix[i, j] != 0.0:
                place[count], value[count] = j, matrix[i, j]
                count += 1
        first[i + 1] = count
    return first, place, value


@compiled_inside
def _zeros(wide):  # type: ignore[no-untyped-def]
    """A row of zeros."""
    row = aligned_rows(wide)
    row[:] = 0.0
    return row


@compiled_inside
def _rows(matrix, wide):  # type: ignore[no-untyped-def]
    """The square `matrix` in rows of `wide` values of LANES numbers, filled up with zeros."""
    n = len(matrix)
    rows = _zeros(n * wide)
    for i in range(n):
        for j in range(n):
            rows[i * wide + j // LANES, j % LANES] = matrix[i, j]
    return rows


@compiled
def innovations(columns, coefficients, innovation_sigma, sigma):  # type: ignore[no-untyped-def]
    """`columns` (samples, n) of autoregressive noise of `coefficients` (order,), white and of unit variance.

    The first samples, of which too little of the past is known, are taken for independent.
    """
    order = len(coefficients)
    white = np.empty(columns.shape)
    for k in range(columns.shape[0]):
        for i in range(columns.shape[1]):
            if k < order:
                white[k, i] = columns[k, i] / sigma
            else:
                left = columns[k, i]
                for lag in range(order):
                    left -= coefficients[lag] * columns[k - lag - 1, i]
                white[k, i] = left / innovation_sigma
    return white


@compiled
def untimely_variance(square, speed, bend, least):  # type: ignore[no-untyped-def]
    """`square` speed + square^2 bend (samples,), at `least` that share of its first term."""
    found = np.empty(len(speed))
    for k in range(len(speed)):
        first = square * speed[k]
        found[k] = max(first + square * square * bend[k], least * first)
    return found


@compiled
def seen_part(w, sway, variance, dead_zone, smallest, nodes, weights):  # type: ignore[no-untyped-def]
    """The share (samples,) of a disturbance of mean `sway` and `variance` added to w that shows behind a dead
    zone, nearest in the mean square, and the mean square of what is then missing.

    Means are those of Gauss and Hermite's `nodes` and `weights`. A missing part whose square is less than
    `smallest` is none, and the share then a whole number.
    """
    shares, doubts = np.empty(len(w)), np.empty(len(w))
    for k in range(len(w)):
        root = np.sqrt(variance[k])
        at_rest = behind_dead_zone(w[k], dead_zone)
        squares, products, parts = 0.0, 0.0, 0.0
        for i in range(len(nodes)):
            added = sway[k] + nodes[i] * root
            part = behind_dead_zone(w[k] + added, dead_zone) - at_rest
            squares += weights[i] * added * added
            products += weights[i] * part * added
            parts += weights[i] * part * part
        share = 1.0 if abs(w[k]) > dead_zone else 0.0
        if squares > 0:
            share = products / max(squares, 1e-300)
        doubt = max(parts - share * products, 0.0)
        whole = np.round(share)
        if doubt + (share - whole) ** 2 * squares < smallest:
            share, doubt = whole, 0.0
        shares[k], doubts[k] = share, doubt
    return shares, doubts


@compiled
def bridged_over(columns, gaps):  # type: ignore[no-untyped-def]
    """`columns` (samples, n) with the samples in `gaps` (samples,) half way between the last one before that
    is in none and the next one, or between the last two where there is no next one."""
    samples, n = columns.shape
    found, before, last = columns.copy(), -1, -1
    for k in range(samples):
        if not gaps[k]:
            before, last = last, k
            continue
        after = k + 1
        while after < samples and gaps[after]:
            after += 1
        lower, upper = last if last >= 0 else after, after
        if after == samples:
            lower, upper = before if before >= 0 else last, last
        for i in range(n):
            found[k, i] = 0.5 * (columns[lower, i] + columns[upper, i])
    return found
