"""The smallest gap found is that of the curve that the outcomes were drawn from."""

from __future__ import annotations

import numpy as np
from scipy import special

from bayes_hw.gap.blind.power import smallest_gap


def drawn(count: int, seed: int) -> tuple[list[float], list[bool]]:
    """Outcomes with P = logistic(4 log(g / 0.8)), which passes 0.9 at 0.8 9^(1/4) = 1.386."""
    rng = np.random.default_rng(seed)
    gaps = np.exp(rng.uniform(np.log(0.3), np.log(5.0), count))
    right = rng.random(count) < special.expit(4 * np.log(gaps / 0.8))
    return gaps.tolist(), right.tolist()


def test_threshold_of_many_outcomes() -> None:
    found = smallest_gap(*drawn(4000, 1), np.random.default_rng(1))
    assert abs(found.gap / (0.8 * 9**0.25) - 1) < 0.08


def test_interval_covers() -> None:
    """At least 9 of 12 intervals from 60 outcomes each hold the truth."""
    truth = 0.8 * 9**0.25
    held = 0
    for seed in range(12):
        low, high = smallest_gap(*drawn(60, seed), np.random.default_rng(seed)).interval
        held += low <= truth <= high
    assert held >= 9


def test_beyond_the_gaps_tried_only_the_side_is_known() -> None:
    gaps = [0.5, 1.0, 2.0, 4.0] * 5
    assert smallest_gap(gaps, [False] * 20, np.random.default_rng(1)).gap == float("inf")
    assert smallest_gap(gaps, [True] * 20, np.random.default_rng(1)).gap == 0.0
