"""Stretches of a mask begin and end where it does."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.arrays import highest_peaks, stretches_of


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
