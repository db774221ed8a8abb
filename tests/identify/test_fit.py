"""The fit percentage of eq. 14 has the values that its definition gives."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.identify.validation import fit_percent

MEASURED = np.array([1.0, 3.0, 5.0, 3.0])


def test_a_perfect_simulation_has_100() -> None:
    assert fit_percent(MEASURED, MEASURED) == 100


def test_the_mean_has_0() -> None:
    assert fit_percent(MEASURED, np.full(4, 3.0)) == 0


def test_half_the_spread_left_is_50() -> None:
    assert fit_percent(MEASURED, (MEASURED + 3.0) / 2) == pytest.approx(50)


def test_worse_than_the_mean_is_negative() -> None:
    assert fit_percent(MEASURED, 6.0 - MEASURED) == pytest.approx(-100)


def test_a_constant_output_is_refused() -> None:
    with pytest.raises(ValueError, match="constant"):
        fit_percent(np.ones(4), MEASURED)
