"""A saturation is fitted to a rebuilt curve exactly where the curve is one."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.identify.input_nonlinearity import fit_saturation

GRID = np.linspace(-1.0, 1.2, 221)


def test_slope_and_unequal_limits_are_found() -> None:
    curve = 2.5 * np.clip(GRID, -0.4, 0.7)
    slope, lower, upper = fit_saturation(GRID, curve, np.ones_like(GRID))
    assert (slope, lower, upper) == pytest.approx((2.5, -0.4, 0.7))


def test_a_straight_line_has_its_limits_at_the_ends() -> None:
    assert fit_saturation(GRID, 2 * GRID, np.ones_like(GRID)) == pytest.approx((2.0, -1.0, 1.2))


def test_commands_of_one_sign_have_one_limit() -> None:
    positive = np.linspace(0.0, 1.0, 101)
    slope, lower, upper = fit_saturation(positive, np.minimum(positive, 0.6), np.ones(101))
    assert (slope, lower, upper) == pytest.approx((1.0, 0.0, 0.6))
