"""Poles and residues in continuous time, sampled back with a zero-order hold, are those they came from."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bayes_hw.gap.simulate.continuous_poles import FASTEST_POLE, continuous_poles

RATE = 20.0
NONE = np.zeros(0, dtype=np.complex128)


def sampled(pole: complex, residue: complex) -> complex:
    """The residue of the zero-order-hold equivalent of residue / (s - pole)."""
    return residue / RATE if pole == 0 else residue * (np.exp(pole / RATE) - 1) / pole


@given(
    st.lists(st.floats(0.05, 0.99), max_size=3),
    st.lists(st.tuples(st.floats(0.1, 0.999), st.floats(0.05, 3.0)), max_size=3),
    st.integers(0, 1000),
)
def test_poles_and_residues_come_back(real: list[float], pairs: list[tuple[float, float]], seed: int) -> None:
    rng = np.random.default_rng(seed)
    real_poles = np.array([*real, 1.0])
    pair_poles = np.array([radius * np.exp(1j * turn) for radius, turn in pairs], dtype=np.complex128)
    residues = rng.normal(size=len(real_poles))
    pair_residues = rng.normal(size=len(pairs)) + 1j * rng.normal(size=len(pairs))
    system = continuous_poles(real_poles, pair_poles, residues, pair_residues, RATE)
    np.testing.assert_allclose(np.exp(system.poles / RATE), [*real_poles, *pair_poles], rtol=1e-9)
    back = [sampled(pole, residue) for pole, residue in zip(system.poles, system.residues, strict=True)]
    np.testing.assert_allclose(back, [*residues, *pair_residues], rtol=1e-9)
    assert system.real.tolist() == [1.0] * len(real_poles) + [0.0] * len(pairs)


def test_a_negative_pole_is_a_pair_at_half_the_sample_rate() -> None:
    system = continuous_poles(np.array([1.0, -0.2]), NONE, np.array([1.0, 0.7]), NONE, RATE)
    pole, residue = system.poles[1], system.residues[1]
    assert np.exp(pole / RATE) == pytest.approx(-0.2)
    assert system.real[1] == 0
    assert 2 * sampled(pole, residue) == pytest.approx(0.7)


def test_a_pole_at_zero_is_a_very_fast_one() -> None:
    system = continuous_poles(np.array([0.0]), NONE, np.array([2.0]), NONE, RATE)
    assert system.poles[0] == pytest.approx(np.log(FASTEST_POLE) * RATE)
