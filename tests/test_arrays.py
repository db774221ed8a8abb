"""Stretches of a mask, peaks, and spreads that outliers do not move."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.arrays import highest_peaks, robust_sigma, spanned, stretches_of, white_sigma


@given(st.lists(st.booleans(), max_size=30))
def test_stretches_make_up_the_mask_and_never_touch(marked: list[bool]) -> None:
    starts, stops = stretches_of(np.array(marked, dtype=np.bool_))
    again = np.zeros(len(marked), dtype=np.bool_)
    for start, stop in zip(starts, stops, strict=True):
        again[start:stop] = True
    assert again.tolist() == marked
    assert (starts < stops).all() and (starts[1:] > stops[:-1]).all()


def test_peaks_come_the_highest_first_ends_and_plateaus_among_them() -> None:
    values = np.array([5.0, 1.0, 3.0, 3.0, 0.0, 7.0, -np.inf, 2.0])
    assert highest_peaks(values).tolist() == [5, 0, 2, 3, 7]
    assert highest_peaks(np.array([])).tolist() == []


def test_what_rows_span_is_counted_over_all_of_them() -> None:
    assert spanned([np.array([0.0, 3.0, 1.0]), np.array([0.0, -2.0])]) == 5.0


def test_a_robust_spread_is_that_of_most_values_and_leaves_out_what_was_not_measured() -> None:
    values = np.random.default_rng(3).normal(0.0, 0.02, 20_000)
    values[::10] = 40.0
    values[1::50] = np.nan
    assert abs(robust_sigma(values) / 0.02 - 1) < 0.25
    assert abs(robust_sigma(values[2::10]) / 0.02 - 1) < 0.05


def test_white_noise_is_told_from_slow_motion_by_third_differences() -> None:
    noise = np.random.default_rng(4).normal(0.0, 0.02, (2, 10_000))
    noise[0, ::77] = np.nan
    slow = 5.0 * np.sin(np.arange(10_000) / 500.0)
    assert abs(white_sigma([slow + one for one in noise]) / 0.02 - 1) < 0.05
