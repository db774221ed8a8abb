"""Compiled filters of the noise that is not stationary: clock jitter, held samples, noise with a state."""

from __future__ import annotations

import numpy as np
from numba import njit

LOG_2PI = np.log(2 * np.pi)

SETTLED = 1e-7
"""Relative change of the state's variance in a sample below which the gain is kept."""

SETTLED_AGAIN = 1e-4
"""The same once the output has changed: it will change again."""


@njit(cache=True, nogil=True, error_model="numpy")
def jitter_filter(columns, coefficient, innovation_variance, extra_variance, white):  # type: ignore[no-untyped-def]
    """Kalman filter of first-order noise plus white noise of known, changing variance; the log-determinant.

    n(k) = coefficient n(k-1) + a(k), e(k) = n(k) + r(k) with var a = innovation_variance and
    var r(k) = extra_variance[k]. `columns` (samples, m) are filtered with the same gains into `white`.
    """
    samples, m = columns.shape
    state = np.zeros(m)
    variance = innovation_variance / (1 - coefficient**2)
    log_determinant = 0.0
    for k in range(samples):
        total = variance + extra_variance[k]
        gain = variance / total
        root = np.sqrt(total)
        log_determinant += np.log(total)
        for j in range(m):
            innovation = columns[k, j] - state[j]
            white[k, j] = innovation / root
            state[j] = coefficient * (state[j] + gain * innovation)
        variance = coefficient**2 * variance * (1 - gain) + innovation_variance
    return log_determinant


@njit(cache=True, nogil=True, error_model="numpy")
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


@njit(cache=True, nogil=True, error_model="numpy")
def state_filter(columns, transition, output, share, doubt, increment, initial, white, expected, variances):  # type: ignore[no-untyped-def]
    """Kalman filter of noise with a state; the log-determinant of the innovations' variances.

    x(k+1) = transition x(k) + a(k) with var a = increment (n, n), x(0) of variance `initial`;
    e(k) = output x(k), of all but its last term the `share` (samples,) that shows, and noise of variance
    `doubt` (samples,). `columns` (samples, m) are filtered into `white`, unit innovations where they are
    such noise;
    `expected` (samples, m) is what the samples before let expect of output x(k) without its last term,
    `variances` (samples,) how uncertain that is. The gain is kept once it no longer changes.
    """
    samples, m = columns.shape
    n = len(output)
    variance = initial.copy()
    state = np.zeros((m, n))
    gain = np.zeros(n)
    shown = output.copy()
    settled, limit = False, SETTLED
    total, root, log_total, uncertain = 1.0, 1.0, 0.0, 0.0
    log_determinant = 0.0
    carried = np.zeros((n, n))
    following = np.zeros((n, n))
    row, per_spread, column = np.zeros(n), np.zeros(n), np.zeros(n)
    columnwise = np.ascontiguousarray(transition.T)
    for k in range(samples):
        changed = k == 0 or share[k] != share[k - 1]
        if doubt[k] > 0 or (k > 0 and (changed or doubt[k - 1] > 0)):
            settled, limit = False, SETTLED_AGAIN
        if changed:
            for i in range(n - 1):
                shown[i] = share[k] * output[i]
        if not settled:
            total = doubt[k]
            column[:] = 0.0
            for j in range(n):
                for i in range(n):
                    column[i] += variance[j, i] * shown[j]
            for i in range(n):
                total += shown[i] * column[i]
            total = max(total, 1e-300)
            uncertain = 0.0
            for i in range(n - 1):
                for j in range(n - 1):
                    uncertain += output[i] * variance[i, j] * output[j]
            root, log_total = np.sqrt(total), np.log(total)
            for i in range(n):
                gain[i] = column[i] / total
            for i in range(n):
                for j in range(n):
                    carried[i, j] = variance[i, j] - gain[i] * column[j]
            for i in range(n):
                row[:] = 0.0
                for a in range(n):
                    weight = transition[i, a]
                    if weight != 0.0:
                        for b in range(n):
                            row[b] += weight * carried[a, b]
                for j in range(i + 1):
                    value = increment[i, j]
                    for b in range(n):
                        value += row[b] * transition[j, b]
                    following[i, j] = value
                per_spread[i] = 1 / (np.sqrt(abs(following[i, i])) + 1e-150)
            moved = 0.0
            for i in range(n):
                for j in range(i + 1):
                    change = abs(following[i, j] - variance[i, j])
                    moved = max(moved, change * per_spread[i] * per_spread[j])
                    variance[i, j] = following[i, j]
                    variance[j, i] = following[i, j]
            settled = moved < limit and k > n
        log_determinant += log_total
        variances[k] = uncertain
        for c in range(m):
            disturbance = 0.0
            for i in range(n - 1):
                disturbance += output[i] * state[c, i]
            expected[k, c] = disturbance
            innovation = columns[k, c] - output[n - 1] * state[c, n - 1] - share[k] * disturbance
            white[k, c] = innovation / root
            row[:] = 0.0
            for j in range(n):
                corrected = state[c, j] + gain[j] * innovation
                for i in range(n):
                    row[i] += columnwise[j, i] * corrected
            for i in range(n):
                state[c, i] = row[i]
    return log_determinant
