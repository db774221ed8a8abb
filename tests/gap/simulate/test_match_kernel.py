"""Derivatives of the matched response, and what a match does with a start that is off or has no answer."""

from __future__ import annotations

import numpy as np
from drive_axis import TRAIN

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap.simulate.drive_train import SMALLEST_MISFIT, USUAL_LOG_SD, DriveTrain
from bayes_hw.gap.simulate.match_kernel import COUNT, WITHOUT_RESPONSE, log_ratios, matched, solve_positive
from bayes_hw.model.lanes import LANES

S_AXIS = 2j * np.pi * np.geomspace(0.05, 9.0, 40)
OMEGA = np.ascontiguousarray(S_AXIS.imag)
EXACT = DriveTrain(TRAIN.logs, 1.0, 0.0).response(S_AXIS)


def in_rows(values: FloatArray) -> FloatArray:
    """`values` (n,) in rows of LANES, the last one again where they end."""
    return np.pad(values, (0, -len(values) % LANES), mode="edge").reshape(-1, LANES)


def found_ratios(logs: FloatArray, target: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """log(R / target) (frequencies,) and its derivatives (10, frequencies); every fifth is not counted."""
    w = in_rows(OMEGA)
    asked = np.concatenate([in_rows(target.real), in_rows(target.imag)])
    counted = np.ones_like(w)
    counted.ravel()[::5] = 0.0
    ratios, slopes = np.empty((2 * len(w), w.shape[1])), np.empty((20 * len(w), w.shape[1]))
    log_ratios(logs, 1.0, w, asked, counted, ratios, slopes)
    real, imaginary = ratios.reshape(2, -1)[:, : len(OMEGA)]
    of_all = slopes.reshape(COUNT, 2, -1)[:, :, : len(OMEGA)]
    return real + 1j * imaginary, of_all[:, 0] + 1j * of_all[:, 1]


def test_derivatives_are_those_of_central_differences() -> None:
    """Off the exact train, at every frequency, by each of the ten logarithms; nothing where not counted."""
    logs = TRAIN.logs + 0.1 * np.random.default_rng(1).normal(size=COUNT)
    ratios, slopes = found_ratios(logs, EXACT)
    expected = np.log(DriveTrain(logs, 1.0, 0.0).response(S_AXIS) / EXACT)
    expected[::5] = 0.0
    np.testing.assert_allclose(ratios, expected, rtol=1e-12, atol=1e-14)
    for i in range(COUNT):
        step = 1e-5 * np.eye(COUNT)[i]
        up, down = (found_ratios(logs + sign * step, EXACT)[0] for sign in (1, -1))
        np.testing.assert_allclose(slopes[i], (up - down) / 2e-5, rtol=1e-6, atol=1e-9)


def test_a_response_that_is_not_finite_pulls_nowhere() -> None:
    target = EXACT.copy()
    target[3] = np.nan
    ratios, slopes = found_ratios(TRAIN.logs, target)
    assert ratios[3] == WITHOUT_RESPONSE
    np.testing.assert_array_equal(slopes[:, 3], 0)
    np.testing.assert_allclose(ratios[np.arange(40) != 3], 0, atol=1e-12)


def test_the_match_finds_the_train_and_says_what_is_left() -> None:
    """From a tenth off; and where the target is no number, a misfit that no drive train passes with."""
    start = TRAIN.logs + 0.1
    arguments = (USUAL_LOG_SD, 0.03, SMALLEST_MISFIT, 7, 3, 0.5, OMEGA)
    logs, misfit = matched(start, start, *arguments, EXACT, 1.0)
    np.testing.assert_allclose(logs, TRAIN.logs, atol=1e-4)
    assert misfit < 1e-4
    _, misfit = matched(start, start, *arguments, np.full(40, np.nan + 0j), 1.0)
    assert misfit >= 5


def test_positive_systems_are_solved_and_others_refused() -> None:
    rng = np.random.default_rng(3)
    half, right = rng.normal(size=(12, 10)), rng.normal(size=10)
    matrix = half.T @ half
    expected = np.linalg.solve(matrix, right)
    found = right.copy()
    assert solve_positive(np.tril(matrix), found)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    for spoilt in (-1.0, np.nan, np.inf):
        bad = matrix.copy()
        bad[4, 4] = spoilt
        assert not solve_positive(bad, right.copy())
