"""Tails fitted to errors of base parameters whose distribution is known."""

from __future__ import annotations

import numpy as np
import pytest
from blind_check.tails import LEVEL, TailFit, Tails, standardized_errors
from scipy.integrate import trapezoid
from scipy.stats import norm, t

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.base_average import DEGREES_ASTRAY
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict


def errors(share: float, scale: float = 1.0, seed: int = 1) -> list[FloatArray]:
    """400 cases of eight parameters."""
    rng = np.random.default_rng(seed)
    astray = scale * rng.standard_t(DEGREES_ASTRAY, (400, 8))
    return list(np.where(rng.random((400, 8)) < share, astray, rng.standard_normal((400, 8))))


@pytest.mark.slow
def test_the_tails_that_made_the_errors_are_found_and_hold() -> None:
    fit = TailFit(errors(0.1, 5.0))
    assert fit.tails.share == pytest.approx(0.1, abs=0.025)
    assert fit.tails.scale == pytest.approx(5.0, rel=0.25)
    assert fit.gain[0] > 3 * fit.gain[1]
    alone, with_tails = fit.held()
    assert alone.value < 0.89 < with_tails.interval[0] < LEVEL < with_tails.interval[1]


@pytest.mark.slow
def test_posteriors_that_are_right_are_left_as_they_are() -> None:
    fit = TailFit(errors(0.0))
    assert fit.tails.share < 0.02
    assert abs(fit.gain[0]) < 3 * fit.gain[1] + 0.01
    alone, with_tails = fit.held()
    assert alone.interval[0] < LEVEL < alone.interval[1]
    assert with_tails.value == pytest.approx(alone.value, abs=0.006)


def test_tails_are_the_sum_of_both_distributions() -> None:
    """Worked from scipy's distributions; an interval holds what its level says, and the density is one."""
    tails = Tails(0.2, 3.0)
    x = np.linspace(-2000, 2000, 400_001)
    assert trapezoid(np.exp(tails.log_density(x)), x) == pytest.approx(1.0, abs=1e-5)
    width = tails.half_width(0.94)
    inside = 0.8 * (2 * norm.cdf(width) - 1) + 0.2 * (2 * t.cdf(width / 3.0, DEGREES_ASTRAY) - 1)
    assert inside == pytest.approx(0.94)
    assert Tails(0.0, 7.0).half_width(0.94) == pytest.approx(1.8808, abs=1e-4)


def test_an_error_is_counted_in_the_deviations_its_interval_stands_for() -> None:
    """A true value at the edge of a 94 % interval is 1.88 away; noise and what is not known are left out."""
    base = {"gain": 3.0, "mode1.frequency_hz": 2.0, "noise.sigma": 9.0}
    truth = CaseTruth("case", (), (), (), base, 0.0, np.zeros(1))
    intervals = {
        "gain": (1.0, 3.0),
        "mode1.frequency_hz": (1.0, 3.0),
        "noise.sigma": (1.0, 2.0),
        "lag": (0.0, 1.0),
    }
    verdict = CaseVerdict((), {}, base=intervals)
    assert standardized_errors(truth, verdict) == pytest.approx([1.8808, 0.0], abs=1e-4)
