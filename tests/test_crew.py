"""Work shared by threads: the same results in the same order, never more threads than the crew has."""

from __future__ import annotations

import time
import warnings
from threading import Lock, get_ident

import numpy as np
import pytest

from bayes_hw.crew import crew, each


class _Count:
    """How many are inside at once, at most."""

    def __init__(self) -> None:
        self.lock, self.now, self.most = Lock(), 0, 0

    def work(self, item: int) -> int:
        with self.lock:
            self.now += 1
            self.most = max(self.most, self.now)
        time.sleep(0.005)
        with self.lock:
            self.now -= 1
        return item**2


@pytest.mark.parametrize("size", [1, 2, 3])
def test_results_come_in_order_from_as_many_threads_as_there_are(size: int) -> None:
    count = _Count()
    with crew(size):
        assert each(count.work, range(12)) == [i**2 for i in range(12)]
    assert count.most == size


def test_loops_inside_loops_share_the_crew() -> None:
    count = _Count()
    with crew(2):
        found = each(lambda i: each(count.work, range(i, i + 4)), [0, 10])
        alone = each(lambda _: each(count.work, range(6)), [0])
    assert found == [[i**2 for i in range(4)], [i**2 for i in range(10, 14)]]
    assert alone == [[i**2 for i in range(6)]]
    assert count.most == 2


def test_a_thread_that_is_done_helps_a_longer_branch() -> None:
    seen: dict[int, set[int]] = {1: set(), 60: set()}

    def branch(length: int) -> None:
        def work(_: int) -> None:
            seen[length].add(get_ident())
            time.sleep(0.005)

        each(work, range(length))

    with crew(2):
        each(branch, [1, 60])
    assert len(seen[1]) == 1
    assert len(seen[60]) == 2


def test_without_a_crew_nothing_is_shared() -> None:
    count = _Count()
    each(count.work, range(5))
    with crew(2):
        pass
    each(count.work, range(5))
    assert count.most == 1


def test_the_first_error_is_raised_and_the_crew_goes_on() -> None:
    def fails(item: int) -> float:
        if item >= 2:
            raise ValueError(str(item))
        return 1.0

    with crew(2):
        with pytest.raises(ValueError, match="2"):
            each(fails, range(8))
        count = _Count()
        each(count.work, range(8))
    assert count.most == 2


def test_threads_work_under_the_caller_s_settings_of_numerical_errors() -> None:
    with warnings.catch_warnings(), crew(2), np.errstate(all="ignore"):
        warnings.simplefilter("error")
        found = each(lambda x: (time.sleep(0.002), np.float64(1.0) / np.float64(x))[1], [0, 0, 0, 0])
    assert np.isinf(found).all()
