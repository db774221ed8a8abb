"""Compiled arithmetic on columns of samples: errors, derivatives, and what one fit makes of them.

Each function is a few microseconds of work and keeps hold of the interpreter. Array expressions in its place
let go of it at every operation on some hundred samples, and threads that fit side by side then wait for each
other at every one of them.
"""

from __future__ import annotations

import numpy as np

from bayes_hw.compiled import compiled


@compiled
def misses(measured, simulated):  # type: ignore[no-untyped-def]
    """Errors (samples, n) of what is `simulated` (samples, n) about what is `measured` (samples,)."""
    errors = np.empty(simulated.shape)
    for k in range(simulated.shape[0]):
        for i in range(simulated.shape[1]):
            errors[k, i] = measured[k] - simulated[k, i]
    return errors


@compiled
def square_sums(columns):  # type: ignore[no-untyped-def]
    """The sum of squares (n,) of every one of `columns` (samples, n)."""
    sums = np.zeros(columns.shape[1])
    for k in range(columns.shape[0]):
        for i in range(columns.shape[1]):
            sums[i] += columns[k, i] * columns[k, i]
    return sums


@compiled
def column(columns, i):  # type: ignore[no-untyped-def]
    """Column i of `columns` (samples, n), contiguous."""
    found = np.empty(columns.shape[0], columns.dtype)
    for k in range(columns.shape[0]):
        found[k] = columns[k, i]
    return found


@compiled
def part(columns, first, count):  # type: ignore[no-untyped-def]
    """`count` of `columns` (samples, n) from `first` on, contiguous."""
    found = np.empty((columns.shape[0], count))
    for k in range(columns.shape[0]):
        for i in range(count):
            found[k, i] = columns[k, first + i]
    return found


@compiled
def filled_out(columns, wide):  # type: ignore[no-untyped-def]
    """`columns` (samples, n) with columns of zeros after them, `wide` in all."""
    found = np.zeros((columns.shape[0], wide))
    for k in range(columns.shape[0]):
        for i in range(columns.shape[1]):
            found[k, i] = columns[k, i]
    return found


@compiled
def scaled(columns, factor):  # type: ignore[no-untyped-def]
    """`columns` (samples, n) times `factor`."""
    white = np.empty(columns.shape)
    for k in range(columns.shape[0]):
        for i in range(columns.shape[1]):
            white[k, i] = columns[k, i] * factor
    return white


@compiled
def blank(columns, gaps):  # type: ignore[no-untyped-def]
    """Make `columns` (samples, n) zero where `gaps` (samples,) is true."""
    for k in range(columns.shape[0]):
        if gaps[k]:
            columns[k] = 0.0


@compiled
def largest_sizes(columns):  # type: ignore[no-untyped-def]
    """The largest size (n,) in every one of `columns` (samples, n), infinite where one is not a number."""
    found = np.zeros(columns.shape[1])
    for k in range(columns.shape[0]):
        for i in range(columns.shape[1]):
            size = abs(columns[k, i])
            if not size <= found[i]:
                found[i] = size if size == size else np.inf
    return found


@compiled
def only_where(columns, kept):  # type: ignore[no-untyped-def]
    """`columns` (samples, n), zero where `kept` (samples, n), or (samples, 1) for all, is false."""
    found = np.zeros(columns.shape)
    for k in range(columns.shape[0]):
        for i in range(columns.shape[1]):
            if kept[k, min(i, kept.shape[1] - 1)]:
                found[k, i] = columns[k, i]
    return found


@compiled
def mean_squares(columns, starts):  # type: ignore[no-untyped-def]
    """Mean squares (stretches, n) of `columns` (samples, n) over the stretches that begin at `starts`."""
    stretches, n = len(starts), columns.shape[1]
    found = np.zeros((stretches, n))
    for j in range(stretches):
        end = starts[j + 1] if j + 1 < stretches else columns.shape[0]
        for k in range(starts[j], end):
            for i in range(n):
                found[j, i] += columns[k, i] * columns[k, i]
        for i in range(n):
            found[j, i] /= end - starts[j]
    return found


@compiled
def linear_splines_over(signal, knots):  # type: ignore[no-untyped-def]
    """Linear B-splines (samples, knots) over `signal` (samples,), each one at its knot of the growing
    `knots`; the first and the last stay one beyond."""
    count = len(knots)
    found = np.zeros((len(signal), count))
    for k in range(len(signal) if count else 0):
        j = np.searchsorted(knots, signal[k])
        if j == 0 or j == count:
            found[k, min(j, count - 1)] = 1.0
        else:
            share = (signal[k] - knots[j - 1]) / (knots[j] - knots[j - 1])
            found[k, j - 1], found[k, j] = 1 - share, share
    return found


@compiled
def count_true(mask):  # type: ignore[no-untyped-def]
    """How many of `mask` (samples,) are true."""
    count = 0
    for true in mask:
        count += true
    return count


@compiled
def count_finite(values):  # type: ignore[no-untyped-def]
    """How many of `values` (samples,) are finite."""
    count = 0
    for value in values:
        count += np.isfinite(value)
    return count
