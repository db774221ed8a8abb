"""Surprises of chi-squared against its exact tail for an even number of degrees, and where numbers end."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import gammaln, logsumexp
from scipy.stats import chi2, kstest

from bayes_hw.gap.criticism.negative_log_p import chi_squared_negative_log_p


def exact(statistic: float, degrees: int) -> float:
    """The tail of chi-squared of an even number of degrees is that of a Poisson count (A & S 26.4.21)."""
    x, k = statistic / 2, np.arange(degrees // 2)
    return float(x - logsumexp(k * np.log(x) - gammaln(k + 1)))


@pytest.mark.parametrize("degrees", [2, 6, 12, 44])
@pytest.mark.parametrize("statistic", [0.5, 30.0, 1400.0, 1600.0, 5e3, 1e6])
def test_it_is_the_tail(degrees: int, statistic: float) -> None:
    """Also beyond 1500, where the tail is no number any more."""
    assert chi_squared_negative_log_p(statistic, degrees) == pytest.approx(
        exact(statistic, degrees), rel=1e-4
    )


def test_it_is_exponential_where_nothing_is_left() -> None:
    drawn = chi2.rvs(7, size=400, random_state=np.random.default_rng(1))
    assert kstest([chi_squared_negative_log_p(x, 7) for x in drawn], "expon").pvalue > 1e-3


def test_nothing_surprises_less_than_nothing() -> None:
    assert chi_squared_negative_log_p(-3.0, 4) == chi_squared_negative_log_p(0.0, 0) == 0


def test_what_is_no_number_stays_none() -> None:
    assert np.isnan(chi_squared_negative_log_p(float("nan"), 4)) and np.isinf(
        chi_squared_negative_log_p(float("inf"), 4)
    )
