"""Stamps: what rounding explains is uniform, what it does not explain is found where it is."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bayes_hw.log import time_stamps

EPOCH = 1_685_543_398.0


def stamps(rate_hz: float, samples: int, decimals: int, start: float = 0.0) -> np.ndarray:
    return np.round(start + np.arange(samples) / rate_hz, decimals)


@settings(deadline=None)
@given(
    rate_hz=st.floats(10, 75),
    samples=st.integers(32, 500),
    start=st.floats(0, 1) | st.just(EPOCH),
    cut=st.booleans(),
)
def test_stamps_of_two_decimals_are_uniform_at_any_rate_they_resolve(rate_hz, samples, start, cut):
    t = start + np.arange(samples) / rate_hz
    t = np.floor(100 * t) / 100 if cut else np.round(t, 2)
    assert time_stamps.is_uniform(t)


@pytest.mark.parametrize(("rate_hz", "decimals"), [(20, 2), (30, 2), (50, 2), (60, 2), (60, 3)])
@pytest.mark.parametrize("start", [0.0, EPOCH])
def test_a_missing_sample_is_not_taken_for_rounding(rate_hz, decimals, start):
    t = np.delete(stamps(rate_hz, 400, decimals, start), 200)
    assert not time_stamps.is_uniform(t)
    if 10.0**-decimals < 0.5 / rate_hz:
        assert time_stamps.first_step_change(t) == 200


def test_stamps_too_coarse_to_show_a_missing_sample_explain_nothing():
    t = np.delete(stamps(100, 400, 2), 200)
    assert not time_stamps.is_uniform(t)


def test_jitter_within_one_percent_is_uniform_and_beyond_it_is_not():
    steps = 0.05 * np.random.default_rng(3).uniform(0.995, 1.005, size=200)
    assert time_stamps.is_uniform(np.concatenate([[0.0], np.cumsum(steps)]))
    steps[100] = 0.05 * 1.02
    assert not time_stamps.is_uniform(np.concatenate([[0.0], np.cumsum(steps)]))


def test_a_slow_drift_of_the_rate_is_placed_where_the_step_is_farthest_from_the_median():
    steps = 0.05 * np.linspace(1, 1.1, 300)
    t = np.concatenate([[0.0], np.cumsum(steps)])
    assert not time_stamps.is_uniform(t)
    assert time_stamps.first_step_change(t) in (2, 300)


@pytest.mark.parametrize("rate_hz", [10, 12.5, 20, 25, 30, 50, 60, 100, 200, 250, 500, 1000])
@pytest.mark.parametrize("decimals", [4, 6])
@pytest.mark.parametrize("start", [0.0, EPOCH])
def test_the_rate_of_rounded_stamps_is_the_round_number_behind_them(rate_hz, decimals, start):
    assert time_stamps.mean_rate(stamps(rate_hz, 2400, decimals, start)) == rate_hz


def test_a_rate_that_the_stamps_do_resolve_is_not_rounded():
    t = np.arange(2400) / 19.87
    assert time_stamps.mean_rate(t) == pytest.approx(19.87, rel=1e-12)


@settings(deadline=None)
@given(st.lists(st.integers(-5, 5), min_size=1, max_size=30))
def test_the_first_stamp_that_does_not_increase_is_found(steps):
    t = np.concatenate([[0.0], np.cumsum(steps)]).astype(float)
    found = time_stamps.first_not_increasing(t)
    expected = next((i + 1 for i, step in enumerate(steps) if step <= 0), None)
    assert found == expected
