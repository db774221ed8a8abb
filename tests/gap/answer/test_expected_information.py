"""What a command tells of linear effects is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.axis_with_effects import ExpectedInformation

SIGMA = 0.5
SLOPES = np.array([[1.0], [0.0], [2.0]])


def told(first: int) -> ExpectedInformation:
    """Three independent coordinates of unit variance, of which the angle shows the first and the last."""
    signs = np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)], dtype=np.float64)

    def angles(u: FloatArray, count: int) -> FloatArray:
        return signs[:count] @ SLOPES * u

    return ExpectedInformation(signs, np.zeros(3), first, SIGMA, angles, lambda u: SLOPES * u)


def test_nats_of_all_are_half_the_logarithm_of_the_gain_in_precision() -> None:
    """Of J = I + g g' / sigma^2: log(1 + |g|^2 n / sigma^2) / 2; without a command nothing is told."""
    u = np.full(10, 0.3)
    assert told(3).nats(u) == pytest.approx(0.5 * np.log(1 + 5 * 10 * 0.09 / SIGMA**2), abs=1e-6)
    assert told(3).nats(0 * u) == pytest.approx(0.0, abs=1e-6)


def test_of_effects_the_rest_is_averaged_over() -> None:
    """The last coordinate alone beside the first as noise: 1 / var = 1 + 4 n u^2 / (sigma^2 + n u^2)."""
    u = np.full(10, 0.3)
    energy = 10 * 0.09
    assert told(2).narrowing(u) == pytest.approx((1 + 4 * energy / (SIGMA**2 + energy)) ** -0.5, rel=1e-6)


def test_angles_are_of_some_draws() -> None:
    assert told(0).outputs(np.ones(5)).shape == (8, 5)
