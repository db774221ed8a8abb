"""Compiled traffic with the lanes of a simulation; each is short and keeps hold of the interpreter."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, error_model="numpy")
def in_lanes(rows, lanes):  # type: ignore[no-untyped-def]
    """Column `lanes[i]` of `rows` (rows, n) for every lane i."""
    found = np.empty((rows.shape[0], len(lanes)))
    for row in range(rows.shape[0]):
        for i in range(len(lanes)):
            found[row, i] = rows[row, lanes[i]]
    return found


@njit(cache=True, error_model="numpy")
def delay(columns, first, u, delays):  # type: ignore[no-untyped-def]
    """Write u (samples,) into silent `columns` (samples, n) from `first` on, each late by its number of
    samples; what comes too late for a record as long as u is left out."""
    for k in range(len(u)):
        for i in range(len(delays)):
            if k >= delays[i]:
                columns[k, first + i] = u[k - delays[i]]


@njit(cache=True)
def lanes_of(count, records, columns):  # type: ignore[no-untyped-def]
    """The chain (columns,) that every lane simulates: `count` of them a record, the last one again after."""
    found = np.empty(columns, np.int64)
    for i in range(columns):
        found[i] = min(i, count * records - 1) % count
    return found


@njit(cache=True)
def silence(samples, columns):  # type: ignore[no-untyped-def]
    """Commands (samples, columns) of nothing; numpy would let go of the interpreter to make them."""
    return np.zeros((samples, columns))
