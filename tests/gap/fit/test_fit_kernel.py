"""Steps of a fit against what defines them: differences, Broyden's two conditions, normal equations."""

from __future__ import annotations

import numpy as np

from bayes_hw.gap.fit.fit_kernel import agreeing, forward_differences, normal_equations

RNG = np.random.default_rng(4)


def test_derivatives_of_a_linear_response_are_its_matrix() -> None:
    matrix, at, steps = RNG.normal(size=(30, 4)), RNG.normal(size=30), np.array([1e-2, 0.5, 3.0, 1.0])
    moved = at[:, None] + matrix * steps
    np.testing.assert_allclose(forward_differences(moved, at, steps), matrix, atol=1e-12)


def test_a_response_that_runs_away_has_no_derivative_there() -> None:
    moved = np.array([[1.0, np.nan], [np.inf, 2.0]])
    np.testing.assert_array_equal(forward_differences(moved, np.zeros(2), np.ones(2)), [[1, 0], [0, 2]])


def test_updated_derivatives_agree_with_the_step_and_change_in_no_other_direction() -> None:
    slopes, step = RNG.normal(size=(30, 4)), RNG.normal(size=4)
    before, after = RNG.normal(size=30), RNG.normal(size=30)
    updated = agreeing(slopes, step, after, before)
    np.testing.assert_allclose(updated @ step, after - before, atol=1e-12)
    across = np.linalg.qr(np.column_stack([step, RNG.normal(size=(4, 3))]))[0][:, 1:]
    np.testing.assert_allclose(updated @ across, slopes @ across, atol=1e-12)


def test_normal_equations_are_those_of_least_squares() -> None:
    slopes, white = RNG.normal(size=(50, 3)), RNG.normal(size=50)
    curvature, gradient = normal_equations(slopes, white)
    expected = np.linalg.lstsq(slopes, white, rcond=None)[0]
    np.testing.assert_allclose(np.linalg.solve(curvature, gradient), expected, rtol=1e-12)
