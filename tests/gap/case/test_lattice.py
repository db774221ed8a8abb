"""The lattice that readings lie on."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.gap.case.lattice import STEPS_OF_A_PERIOD, shortest_period


def test_an_error_over_position_is_told_from_rounding_by_some_steps() -> None:
    """Of records that count from any place; of readings that are not rounded any period may be."""
    rng, step = np.random.default_rng(2), 0.035
    angles = [np.cumsum(0.02 * rng.standard_normal(800)) for _ in range(2)]
    rounded = [step * np.round(y / step) - start for y, start in zip(angles, (0.0, 0.1234), strict=True)]
    assert shortest_period(rounded) == pytest.approx(STEPS_OF_A_PERIOD * step)
    assert shortest_period(angles) == 0.0
