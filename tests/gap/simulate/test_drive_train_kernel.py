"""Paths through polynomials that vanish, numerators and roots against numpy's."""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.simulate.chain_kernel import MOTOR_ANGLE, MOTOR_SPEED, W
from bayes_hw.gap.simulate.drive_train_kernel import (
    command_path,
    companion,
    numerators,
    resonant,
    torque_path,
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
