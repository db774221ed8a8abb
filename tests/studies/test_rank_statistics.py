"""Bands hold uniform ranks as often as they say, and p-values tell when ranks are not uniform."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rank_statistics import (
    ECDF_POINTS,
    HISTOGRAM_BINS,
    IntervalCoverage,
    SimultaneousBands,
    ecdf_bands,
    ecdf_counts,
    histogram_bands,
    histogram_counts,
)
from scipy import stats

from bayes_hw.arrays import IntArray

DRAWS = 127
REPEATS = 2000


@pytest.mark.parametrize("replicates", [40, 500])
@pytest.mark.parametrize(("make", "count"), [(ecdf_bands, ecdf_counts), (histogram_bands, histogram_counts)])
def test_bands_hold_uniform_ranks_with_their_probability(
    replicates: int,
    make: Callable[[int, np.random.Generator], SimultaneousBands],
    count: Callable[[IntArray, int], IntArray],
) -> None:
    """All points inside in 95 % of the cases, or a little more where counts are few and discrete."""
    rng = np.random.default_rng(1)
    bands = make(replicates, rng)
    ranks = rng.integers(0, DRAWS + 1, size=(REPEATS, replicates))
    counts = np.array([count(row, DRAWS) for row in ranks])
    inside = np.all((counts >= bands.lower) & (counts <= bands.upper), axis=1)
    assert 0.935 < inside.mean() < 0.99


@pytest.mark.slow
def test_p_values_of_uniform_ranks_are_uniform() -> None:
    rng = np.random.default_rng(2)
    bands = ecdf_bands(200, rng)
    ranks = rng.integers(0, DRAWS + 1, size=(500, 200))
    p_values = [bands.p_value(ecdf_counts(row, DRAWS)) for row in ranks]
    for level in (0.05, 0.2, 0.5, 0.8):
        assert np.mean(np.array(p_values) <= level) == pytest.approx(level, abs=0.07)


@pytest.mark.parametrize("exponents", [(0.6, 0.6), (1.6, 1.6), (1.3, 0.8)])
def test_p_value_tells_narrow_wide_and_shifted_posteriors(exponents: tuple[float, float]) -> None:
    rng = np.random.default_rng(3)
    bands = ecdf_bands(500, rng)
    ranks = np.floor(rng.beta(*exponents, size=500) * (DRAWS + 1)).astype(np.int64)
    assert bands.p_value(ecdf_counts(ranks, DRAWS)) < 0.001


@given(st.lists(st.integers(0, DRAWS), min_size=1, max_size=60))
def test_counts_are_those_of_the_ranks(ranks: list[int]) -> None:
    values = np.array(ranks)
    histogram = histogram_counts(values, DRAWS)
    assert histogram.sum() == len(ranks)
    assert histogram[0] == np.count_nonzero(values < (DRAWS + 1) // HISTOGRAM_BINS)
    cumulative = ecdf_counts(values, DRAWS)
    edges = (DRAWS + 1) * np.arange(1, ECDF_POINTS) // ECDF_POINTS
    assert cumulative.tolist() == [np.count_nonzero(values < edge) for edge in edges]


@given(st.integers(1, 400), st.data())
def test_binomial_interval_is_that_of_clopper_and_pearson(replicates: int, data: st.DataObject) -> None:
    """Its ends from the beta distribution, doi 10.1093/biomet/26.4.404."""
    inside = data.draw(st.integers(0, replicates))
    low, high = IntervalCoverage(0.8, inside, replicates).interval
    outside = replicates - inside
    expected_low = stats.beta.ppf(0.025, inside, outside + 1) if inside else 0.0
    expected_high = stats.beta.ppf(0.975, inside + 1, outside) if outside else 1.0
    assert (low, high) == pytest.approx((expected_low, expected_high), abs=1e-9)


def test_binomial_test_agrees_with_its_interval() -> None:
    """Coverage of 90 in 100: 0.94 is within chance, 0.99 is not."""
    assert IntervalCoverage(0.94, 90, 100).agrees
    assert IntervalCoverage(0.94, 90, 100).p_value > 0.05
    assert not IntervalCoverage(0.99, 90, 100).agrees
    assert IntervalCoverage(0.99, 90, 100).p_value == pytest.approx(stats.binom.cdf(90, 100, 0.99), rel=1e-6)
