"""Paths through polynomials that vanish, numerators and roots against numpy's."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.gap.simulate.chain_kernel import LOAD_SPEED, MOTOR_ANGLE, MOTOR_SPEED, W
from bayes_hw.gap.simulate.drive_train_kernel import (
    command_path,
    companion,
    numerators,
    resonant,
    torque_path,
    turning_together,
)


def test_a_path_through_nothing_is_no_number() -> None:
    """Where polynomials vanish at a pole: a far-off trial is then dropped for its response, not a crash."""
    s, ones, zero = np.array([-2.0 + 1j]), np.ones(3), np.zeros(3)
    _, _, inputs, outputs = torque_path(s, zero, ones, ones, zero)
    assert np.isnan(inputs[1]).all() and np.isnan(outputs).all()
    _, _, _, outputs = command_path(s, np.ones(1) + 0j, ones, zero)
    assert np.isnan(outputs[[MOTOR_ANGLE, MOTOR_SPEED]]).all() and (outputs[W] == 1).all()
    residues = resonant(s, s, np.zeros(1), s, s[:0], ones, zero, zero, ones)
    assert np.isnan(residues).all()


def test_numerators_are_those_of_partial_fractions() -> None:
    """Two rows of residues over a real pole and a pair, against numpy's polynomials."""
    poles = np.array([-3.0, -1 + 2j, -1 - 2j])
    residues = np.array([[0.7, 0.2 - 0.4j, 0.2 + 0.4j], [1.5, -0.3j, 0.3j]])
    whole, rows = numerators(poles, residues)
    np.testing.assert_allclose(whole, np.poly(poles).real, atol=1e-12)
    for row, own in zip(rows, residues, strict=True):
        expected = sum(c * np.poly(np.delete(poles, i)) for i, c in enumerate(own))
        np.testing.assert_allclose(row, np.real(expected), atol=1e-12)


def test_the_eigenvalues_of_the_companion_are_the_roots() -> None:
    polynomial = np.array([2.0, -3.0, 5.0, 0.7, -1.1])
    found = np.sort_complex(np.linalg.eigvals(companion(polynomial)))
    np.testing.assert_allclose(found, np.sort_complex(np.roots(polynomial)), rtol=1e-12)


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
