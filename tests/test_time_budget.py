"""A block of limited time, and those inside it."""

from __future__ import annotations

import math

from bayes_hw.crew import crew, each
from bayes_hw.time_budget import at_most, seconds_left, time_is_up


def test_a_block_has_no_more_time_than_the_one_around_it() -> None:
    assert math.isinf(seconds_left())
    assert not time_is_up()
    with at_most(1000.0):
        with at_most(2000.0):
            assert 900 < seconds_left() <= 1000
        with at_most(0.6 * seconds_left()):
            assert 500 < seconds_left() <= 600
        assert 900 < seconds_left() <= 1000
    assert math.isinf(seconds_left())
    with at_most(0.5 * seconds_left()):
        assert math.isinf(seconds_left())


def test_threads_of_a_crew_share_the_time() -> None:
    with at_most(0.0), crew(2):
        assert each(lambda _: time_is_up(), [0, 1, 2]) == [True] * 3
