"""Tails fitted to errors of base parameters whose distribution is known."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict
from bayes_hw.gap.blind.tails import LEVEL, TailFit, standardized_errors


def errors(degrees: float, seed: int = 1) -> list[FloatArray]:
    """400 cases of eight parameters."""
    rng = np.random.default_rng(seed)
    drawn = rng.standard_normal((400, 8))
    return list(drawn if np.isinf(degrees) else rng.standard_t(degrees, (400, 8)))


def test_the_degrees_that_made_the_errors_are_found_and_hold() -> None:
    fit = TailFit(errors(4.0))
    assert fit.degrees == pytest.approx(4.0, rel=0.15)
    assert fit.gain[0] > 3 * fit.gain[1]
    alone, with_tails = fit.held()
    assert alone.value < 0.89 < with_tails.interval[0] < LEVEL < with_tails.interval[1]


def test_posteriors_that_are_right_are_left_as_they_are() -> None:
    fit = TailFit(errors(np.inf))
    assert fit.degrees > 30
    assert abs(fit.gain[0]) < 3 * fit.gain[1] + 0.01
    alone, with_tails = fit.held()
    assert alone.interval[0] < LEVEL < alone.interval[1]
    assert with_tails.value == pytest.approx(alone.value, abs=0.006)


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
