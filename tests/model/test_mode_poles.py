"""Poles of many modes at once are those of each alone."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.model.linear import mode_pole
from bayes_hw.model.mode_poles import mode_poles


@pytest.mark.parametrize("walkers", [1, 16, 37])
def test_poles_are_those_of_each_mode(walkers: int) -> None:
    """From nearly undamped to nearly critical, up to the Nyquist frequency and beyond, to rounding."""
    rng = np.random.default_rng(walkers)
    frequency = np.exp(rng.uniform(np.log(1e-3), np.log(40.0), (3, walkers)))
    damping = np.exp(rng.uniform(np.log(1e-5), np.log(0.999), (3, walkers)))
    found = mode_poles(frequency, damping, 20.0)
    expected = mode_pole(frequency, damping, 20.0)
    np.testing.assert_allclose(found.real, expected.real, rtol=0, atol=3e-16)
    np.testing.assert_allclose(found.imag, expected.imag, rtol=0, atol=3e-16)


def test_what_is_no_number_stays_with_its_walker() -> None:
    frequency, damping = np.full((2, 5), 2.0), np.full((2, 5), 0.05)
    frequency[1, 3] = np.nan
    found = mode_poles(frequency, damping, 20.0)
    assert np.isnan(found[1, 3]) and np.isnan(found).sum() == 1
