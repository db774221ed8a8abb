"""The smallest gap found is that of the curve that the outcomes were drawn from."""

from __future__ import annotations

import numpy as np
import pytest
from blind_check.power import REACH, SLOPE_LOG_SD, SLOPE_MEAN, smallest_gap
from scipy import special

TRIED = LOW, HIGH = 0.3, 5.0


def drawn(count: int, rng: np.random.Generator, gap: float, slope: float) -> tuple[list[float], list[bool]]:
    """Outcomes that are right with probability 0.9 at `gap`."""
    gaps = np.exp(rng.uniform(np.log(LOW), np.log(HIGH), count))
    right = rng.random(count) < special.expit(special.logit(0.9) + slope * np.log(gaps / gap))
    return gaps.tolist(), right.tolist()


@pytest.mark.slow
def test_threshold_of_many_outcomes() -> None:
    found = smallest_gap(*drawn(4000, np.random.default_rng(1), 1.4, 4.0), TRIED)
    assert found.gap == pytest.approx(1.4, rel=0.06)
    assert found.interval[1] / found.interval[0] < 1.2


@pytest.mark.parametrize("count", [6, pytest.param(40, marks=pytest.mark.slow)])
def test_intervals_cover_as_they_say(count: int) -> None:
    """Of 400 curves drawn from the prior 95 % are held: few outcomes, or nearly all right, are no exception.

    Ends beyond the gaps tried are open.
    """
    rng, held, trials = np.random.default_rng(count), 0, 400
    for _ in range(trials):
        gap = np.exp(rng.uniform(np.log(LOW) - REACH, np.log(HIGH) + REACH))
        slope = SLOPE_MEAN * np.exp(SLOPE_LOG_SD * rng.standard_normal())
        low, high = smallest_gap(*drawn(count, rng, float(gap), float(slope)), TRIED).interval
        held += low <= gap <= high or (high == 0.0 and gap < LOW) or (low == np.inf and gap > HIGH)
    assert 0.925 * trials <= held


def test_a_miss_at_a_large_gap_raises_it() -> None:
    gaps, right = drawn(30, np.random.default_rng(3), 1.0, 4.0)
    missed, named = (smallest_gap([*gaps, 4.9], [*right, last], TRIED).gap for last in (False, True))
    assert missed > named


def test_beyond_the_gaps_tried_only_the_side_is_known() -> None:
    """All right says that it is small, and no more; how small an interval's upper end may be still counts."""
    gaps = [0.5, 1.0, 2.0, 4.0] * 5
    assert smallest_gap(gaps, [False] * 20, TRIED).gap == float("inf")
    found = smallest_gap(gaps, [True] * 20, TRIED)
    assert found.gap == found.interval[0] == 0.0 < found.interval[1] < 1.0


def test_misses_of_small_gaps_say_little_of_large_ones() -> None:
    """Where an effect was drawn small by chance, its smallest gap may still be within the range tried."""
    found = smallest_gap([0.31, 0.32, 0.35], [False] * 3, TRIED)
    assert LOW < found.interval[0] < 1.0 and found.interval[1] == np.inf
