"""Derivatives of the matched response, and what a match does with a start that is off or has no answer."""

from __future__ import annotations

import numpy as np
from drive_axis import TRAIN

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap.chain_kernel import MOTOR_ANGLE, MOTOR_SPEED, W
from bayes_hw.gap.drive_train import SMALLEST_MISFIT, USUAL_LOG_SD, DriveTrain
from bayes_hw.gap.drive_train_kernel import (
    COUNT,
    _log_ratio,
    _numbers,
    command_path,
    companion,
    matched,
    numerators,
    resonant,
    torque_path,
)

S_AXIS = 2j * np.pi * np.geomspace(0.05, 9.0, 40)
EXACT = DriveTrain(TRAIN.logs, 1.0, 0.0).response(S_AXIS)


def log_ratio(logs: FloatArray, s: complex, target: complex) -> tuple[complex, ComplexArray]:
    slope = np.empty(COUNT, dtype=np.complex128)
    return complex(_log_ratio(_numbers(logs), 1.0, s, target, slope)), slope


def test_derivatives_are_those_of_central_differences() -> None:
    """Off the exact train, at every tenth frequency, by each of the ten logarithms."""
    logs = TRAIN.logs + 0.1 * np.random.default_rng(1).normal(size=COUNT)
    for s, target in zip(S_AXIS[::10], EXACT[::10], strict=True):
        ratio, slope = log_ratio(logs, s, target)
        response = DriveTrain(logs, 1.0, 0.0).response(np.array([s]))[0]
        np.testing.assert_allclose(ratio, np.log(response / target), rtol=1e-12)
        for i in range(COUNT):
            step = 1e-5 * np.eye(COUNT)[i]
            up, down = (log_ratio(logs + sign * step, s, target)[0] for sign in (1, -1))
            np.testing.assert_allclose(slope[i], (up - down) / 2e-5, rtol=1e-6, atol=1e-9)


def test_a_response_that_is_not_finite_pulls_nowhere() -> None:
    ratio, slope = log_ratio(TRAIN.logs, S_AXIS[3], complex(np.nan))
    assert ratio == 10
    np.testing.assert_array_equal(slope, 0)


def test_a_path_through_nothing_is_no_number() -> None:
    """Where polynomials vanish at a pole: a far-off trial is then dropped for its response, not a crash."""
    s, ones, zero = np.array([-2.0 + 1j]), np.ones(3), np.zeros(3)
    _, _, inputs, outputs = torque_path(s, zero, ones, ones, zero)
    assert np.isnan(inputs[1]).all() and np.isnan(outputs).all()
    _, _, _, outputs = command_path(s, np.ones(1) + 0j, ones, zero)
    assert np.isnan(outputs[[MOTOR_ANGLE, MOTOR_SPEED]]).all() and (outputs[W] == 1).all()
    residues = resonant(s, s, np.zeros(1), s, s[:0], ones, zero, zero, ones)
    assert np.isnan(residues).all()


def test_the_match_finds_the_train_and_says_what_is_left() -> None:
    """From a tenth off; and where the target is no number, a misfit that no drive train passes with."""
    start = TRAIN.logs + 0.1
    arguments = (USUAL_LOG_SD, 0.03, SMALLEST_MISFIT, 7, 3, 0.5, S_AXIS)
    logs, misfit = matched(start, start, *arguments, EXACT, 1.0)
    np.testing.assert_allclose(logs, TRAIN.logs, atol=1e-4)
    assert misfit < 1e-4
    _, misfit = matched(start, start, *arguments, np.full(40, np.nan + 0j), 1.0)
    assert misfit >= 5


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
