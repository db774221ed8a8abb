"""Compiled columns against numpy's expressions, on any shape and with numbers that are not finite."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate.columns import (
    blank,
    column,
    count_finite,
    count_true,
    filled_out,
    hats_over,
    largest_sizes,
    mean_squares,
    misses,
    only_where,
    part,
    scaled,
    square_sums,
)

ANY = st.floats(-1e6, 1e6)
SHAPES = st.tuples(st.integers(1, 12), st.integers(1, 5))
COLUMNS = SHAPES.flatmap(lambda shape: arrays(np.float64, shape, elements=ANY))


@settings(deadline=None)
@given(COLUMNS)
def test_arithmetic_is_numpys(columns: FloatArray) -> None:
    samples, n = columns.shape
    measured = np.arange(float(samples))
    np.testing.assert_array_equal(misses(measured, columns), measured[:, None] - columns)
    np.testing.assert_allclose(square_sums(columns), np.sum(columns**2, axis=0), rtol=1e-13)
    np.testing.assert_array_equal(scaled(columns, 0.25), 0.25 * columns)
    np.testing.assert_array_equal(largest_sizes(columns), np.max(np.abs(columns), axis=0))
    np.testing.assert_array_equal(column(columns, n - 1), columns[:, -1])


@settings(deadline=None)
@given(COLUMNS, st.integers(0, 7))
def test_parts_and_fillings(columns: FloatArray, more: int) -> None:
    """A part of what was filled out is what it was, the rest is nothing."""
    n = columns.shape[1]
    wide = filled_out(columns, n + more)
    np.testing.assert_array_equal(part(wide, 0, n), columns)
    assert not part(wide, n, more).any()


def test_a_mask_is_each_columns_own_or_that_of_all() -> None:
    columns = np.array([[1.0, 2.0], [3.0, np.nan], [5.0, 6.0]])
    own = np.array([[True, False], [False, False], [True, True]])
    np.testing.assert_array_equal(only_where(columns, own), [[1, 0], [0, 0], [5, 6]])
    shared = np.array([True, False, True])
    np.testing.assert_array_equal(only_where(columns, shared[:, None]), [[1, 2], [0, 0], [5, 6]])
    blank(columns, ~shared)
    np.testing.assert_array_equal(columns, [[1, 2], [0, 0], [5, 6]])
    assert count_true(shared) == 2


def test_what_is_no_number_is_infinitely_large() -> None:
    columns = np.array([[1.0, np.nan, -np.inf], [np.nan, 2.0, 0.0], [-7.0, 3.0, 1.0]])
    np.testing.assert_array_equal(largest_sizes(columns), np.inf)
    np.testing.assert_array_equal(largest_sizes(columns[2:]), [[7, 3, 1]][0])
    assert count_finite(columns[1]) == 2


@settings(deadline=None)
@given(COLUMNS.filter(lambda c: len(c) > 3))
def test_mean_squares_of_stretches(columns: FloatArray) -> None:
    starts = np.array([0, 1, 3])
    expected = [np.mean(s**2, axis=0) for s in np.split(columns, starts[1:])]
    np.testing.assert_allclose(mean_squares(columns, starts), expected, rtol=1e-13)


@settings(deadline=None)
@given(arrays(np.float64, 20, elements=st.floats(-3, 4)))
def test_hats_are_interpolations_of_unit_values(signal: FloatArray) -> None:
    """Also at the knots and beyond the outer ones; everywhere they add up to one."""
    knots = np.array([-1.5, -1.0, 0.25, 2.0])
    signal = np.concatenate([signal, knots])
    expected = np.stack([np.interp(signal, knots, row) for row in np.eye(4)], axis=1)
    np.testing.assert_allclose(hats_over(signal, knots), expected, atol=1e-14)
    np.testing.assert_allclose(hats_over(signal, knots).sum(axis=1), 1.0, rtol=1e-14)
