"""Small systems in parallel and in series respond as the sum and the product."""

from __future__ import annotations

import numpy as np

from bayes_hw.control.state_space import StateSpace, series

A = StateSpace.first_order(0.5, 1.0, 2.0, 0.3)
B = StateSpace.biquad(1.0, 0.2, 0.1, -0.4, 0.3)


def response(system: StateSpace, z: complex) -> complex:
    inner = np.linalg.solve(z * np.eye(system.order) - system.a, system.b) if system.order else np.zeros(0)
    return complex(system.c @ inner + system.d)


def test_parallel_and_series() -> None:
    z = np.exp(0.7j)
    np.testing.assert_allclose(response(A.parallel(B), z), response(A, z) + response(B, z))
    np.testing.assert_allclose(response(series(A, B), z), response(A, z) * response(B, z))
    np.testing.assert_allclose(response(series(StateSpace.gain(3.0), A), z), 3 * response(A, z))
    assert response(B, z) == response(StateSpace.gain(0.0).parallel(B), z)


def test_biquad_is_its_fraction() -> None:
    z = np.exp(0.7j)
    expected = (1.0 + 0.2 / z + 0.1 / z**2) / (1 - 0.4 / z + 0.3 / z**2)
    np.testing.assert_allclose(response(B, z), expected)
