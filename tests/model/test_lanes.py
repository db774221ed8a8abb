"""Arithmetic on lanes is ordinary arithmetic, lane by lane, with the NaN rule that the kernel relies on."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit

from bayes_hw.model.lanes import (
    LANES,
    aligned_rows,
    broadcast,
    filled_up,
    gather,
    load,
    maximum,
    minimum,
    padded_to_lanes,
    scatter,
    store,
)


@njit
def scaled_by_broadcast(a, number, out):  # type: ignore[no-untyped-def]
    store(out, 0, broadcast(number) * load(a, 0))


@njit
def _operate(a, b, out):  # type: ignore[no-untyped-def]
    left, right = load(a, 1), load(b, 0)
    store(out, 0, left + right)
    store(out, 1, left - right)
    store(out, 2, left * right)
    store(out, 3, minimum(left, right))
    store(out, 4, maximum(left, right))
    store(out, 5, left / right)


def operated(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Rows: sum, difference, product, minimum, maximum, quotient."""
    out = np.full((6, LANES), np.nan)
    _operate(np.stack([np.zeros(LANES), a]), b[None, :], out)
    return out


def test_operations_are_those_of_numpy() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(2, LANES))
    a[3] = b[3]
    expected = [a + b, a - b, a * b, np.minimum(a, b), np.maximum(a, b), a / b]
    np.testing.assert_array_equal(operated(a, b), expected)


def test_broadcast_fills_every_lane() -> None:
    a = np.arange(LANES, dtype=np.float64)[None, :]
    out = np.empty((1, LANES))
    scaled_by_broadcast(a, 2.5, out)
    np.testing.assert_array_equal(out, 2.5 * a)


def test_extrema_keep_a_left_nan_in_its_lane() -> None:
    """A response that has become NaN must not come out of the dead zone as zero."""
    a, b = np.arange(LANES, dtype=np.float64), np.full(LANES, 5.0)
    a[7] = np.nan
    out = operated(a, b)
    for row, expected in ((3, np.minimum(a, b)), (4, np.maximum(a, b))):
        np.testing.assert_array_equal(out[row], expected)


def test_infinities_are_ordered() -> None:
    a, b = np.zeros(LANES), np.zeros(LANES)
    a[:2], b[2:4] = [np.inf, -np.inf], [np.inf, -np.inf]
    out = operated(a, b)
    np.testing.assert_array_equal(out[3], np.minimum(a, b))
    np.testing.assert_array_equal(out[4], np.maximum(a, b))


@njit
def copied(values):  # type: ignore[no-untyped-def]
    out = np.empty_like(values)
    for group in range(values.shape[-1] // LANES):
        rows = aligned_rows(values.size // values.shape[-1])
        gather(values, group, rows)
        scatter(rows, group, out)
    return out, rows


@pytest.mark.parametrize("walkers", [1, LANES, LANES + 1, 2 * LANES])
def test_groups_hold_every_walker_once_and_repeat_the_last(walkers: int) -> None:
    values = np.arange(6.0 * walkers).reshape(2, 3, walkers)
    full = filled_up(values)
    assert full.shape == (2, 3, padded_to_lanes(walkers))
    assert full.flags.c_contiguous
    np.testing.assert_array_equal(full[..., :walkers], values)
    assert (full[..., walkers:] == values[..., -1:]).all()
    found, last = copied(full)
    np.testing.assert_array_equal(found, full)
    np.testing.assert_array_equal(last, full.reshape(6, -1)[:, -LANES:])


def test_rows_begin_with_a_cache_line() -> None:
    for count in (1, 3, 7):
        _, rows = copied(np.zeros((count, LANES)))
        assert rows.ctypes.data % 64 == 0


def test_no_parameters_of_a_kind_are_no_rows() -> None:
    assert filled_up(np.zeros((2, 0, 5))).shape == (2, 0, LANES)
