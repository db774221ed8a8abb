"""After a long constant command motor and load of a drive train turn at one speed."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.gap.simulate.chain_kernel import LOAD_SPEED, MOTOR_ANGLE, MOTOR_SPEED, W
from bayes_hw.gap.simulate.turning import turning_together

POLES = np.array([0.0, -2.0, -40.0, -0.3 + 9j, -0.6 + 25j])


def outputs(seed: int) -> np.ndarray:
    """Gains (4, n), real at real poles, the motor's angle and speed as a derivative has it."""
    rng = np.random.default_rng(seed)
    gains = rng.normal(size=(4, len(POLES))) + 1j * rng.normal(size=(4, len(POLES)))
    gains[:, POLES.imag == 0] = gains[:, POLES.imag == 0].real
    gains[[MOTOR_SPEED, LOAD_SPEED]] = POLES * gains[[MOTOR_ANGLE, W]]
    return gains


def settled_speed(gains: np.ndarray, poles: np.ndarray) -> float:
    """The motor's speed long after a unit step: each state ends at -1 / pole, a pair twice over."""
    total = 0.0
    for pole, gain in zip(poles, gains[MOTOR_SPEED], strict=True):
        if pole != 0:
            total += (1 if pole.imag == 0 else 2) * (-gain / pole).real
    return total


@pytest.mark.parametrize("seed", range(5))
def test_the_motor_turns_at_the_residue_of_the_integrator(seed: int) -> None:
    """Only the fastest real pole's part of the motor changes, and its angle still grows at its speed."""
    gains = outputs(seed)
    turned = turning_together(POLES, gains)
    assert settled_speed(turned, POLES) == pytest.approx(gains[W, 0].real)
    changed = np.argwhere(turned != gains)
    assert sorted(map(tuple, changed.tolist())) == [(MOTOR_ANGLE, 2), (MOTOR_SPEED, 2)]
    assert turned[MOTOR_SPEED, 2] == pytest.approx(POLES[2] * turned[MOTOR_ANGLE, 2])


@pytest.mark.parametrize("kept", [[1, 2, 3, 4], [0, 3, 4]], ids=["no integrator", "no real pole"])
def test_nothing_changes_without_an_integrator_or_a_fast_pole(kept: list[int]) -> None:
    gains = outputs(1)[:, kept].copy()
    np.testing.assert_array_equal(turning_together(POLES[kept].copy(), gains), gains)
