"""Which lane simulates what, and commands that reach their lanes late."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bayes_hw.gap.simulate.batch_kernel import delay, in_lanes, lanes_of, silence


@settings(deadline=None)
@given(st.integers(1, 9), st.integers(1, 4), st.integers(0, 15))
def test_lanes_hold_every_chain_of_every_record_and_the_last_one_again(
    count: int, records: int, more: int
) -> None:
    lanes = lanes_of(count, records, count * records + more)
    np.testing.assert_array_equal(lanes[: count * records], list(range(count)) * records)
    np.testing.assert_array_equal(lanes[count * records :], count - 1)


def test_settings_go_to_their_lanes() -> None:
    rows, lanes = np.array([[1.0, 2.0], [3.0, 4.0]]), np.array([1, 0, 1])
    np.testing.assert_array_equal(in_lanes(rows, lanes), [[2, 1, 2], [4, 3, 4]])


@settings(deadline=None)
@given(st.lists(st.integers(0, 12), min_size=1, max_size=4), st.integers(0, 3))
def test_commands_are_late_by_whole_samples(delays: list[int], longer: int) -> None:
    """Nothing before they arrive, nor where another record of the batch is longer."""
    u = np.arange(1.0, 9.0)
    columns = silence(len(u) + longer, len(delays) + 2)
    delay(columns, 1, u, np.array(delays))
    assert not columns[:, 0].any() and not columns[:, -1].any()
    for i, late in enumerate(delays):
        expected = np.zeros(len(u) + longer)
        expected[late : len(u)] = u[: max(len(u) - late, 0)]
        np.testing.assert_array_equal(columns[:, 1 + i], expected)
