"""Summaries of draws from known distributions."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bayes_hw.infer.summary import highest_density_interval, summarize


def test_summary_of_a_normal_distribution() -> None:
    chains = 2.0 + 3.0 * np.random.default_rng(1).standard_normal((4, 500, 50))
    found = summarize(chains, "deg")
    assert found.mean == pytest.approx(2, abs=0.04) and found.median == pytest.approx(2, abs=0.05)
    assert found.sd == pytest.approx(3, rel=0.01)
    assert found.hdi94 == pytest.approx((2 - 1.8808 * 3, 2 + 1.8808 * 3), abs=0.25)
    assert found.ess_bulk == pytest.approx(100_000, rel=0.1)
    assert found.mcse_mean == pytest.approx(3 / np.sqrt(100_000), rel=0.1)
    assert found.r_hat < 1.001 and found.unit == "deg"


def test_highest_density_interval_of_an_exponential_starts_at_zero() -> None:
    """The shortest 94 % of exp(-x) is [0, -log 0.06]; an equal-tailed interval would start at 0.03."""
    draws = np.random.default_rng(2).exponential(size=200_000)
    low, high = highest_density_interval(draws)
    assert low < 0.003 and high == pytest.approx(-np.log(0.06), abs=0.05)
    assert np.mean((draws >= low) & (draws <= high)) == pytest.approx(0.94, abs=1e-4)


def test_constant_chains_are_plain_json() -> None:
    """No warning, and infinities become null: the file must stay JSON."""
    found = summarize(np.full((2, 60, 4), 1.5), "").to_dict()
    assert (found["mean"], found["sd"], found["r_hat"], found["mcse_mean"]) == (1.5, 0.0, None, None)
    assert found["hdi94"] == [1.5, 1.5]
    json.dumps(found, allow_nan=False)
