"""Friction that falls with speed is implicit within a step: torque and speed at its end agree."""

from __future__ import annotations

import numpy as np
from numba import njit

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate.friction_kernel import falling_torque
from bayes_hw.model.lanes import LANES, aligned_rows, broadcast, load, store

COULOMB, STATIC, STRIBECK_SPEED, SMOOTHING = 2.0, 0.6, 0.3, 1e-4


@njit
def torque_at(speeds, responses, torques):  # type: ignore[no-untyped-def]
    """Torques (n, LANES) at speeds and responses (n, LANES) without friction."""
    for i in range(len(speeds)):
        torque = falling_torque(
            load(speeds, i),
            load(responses, i),
            broadcast(COULOMB),
            broadcast(STATIC),
            broadcast(1 / STRIBECK_SPEED),
            broadcast(1 / SMOOTHING),
            broadcast(SMOOTHING),
        )
        store(torques, i, torque)


def sliding(speed: FloatArray) -> FloatArray:
    """Stribeck's curve."""
    return COULOMB * (1 + STATIC * np.exp(-((speed / STRIBECK_SPEED) ** 2)))


def found(speed: FloatArray, response: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Torque, and the speed at the end of the step, for each of (n LANES,)."""
    rows = len(speed) // LANES
    speeds, responses, torques = aligned_rows(rows), aligned_rows(rows), aligned_rows(rows)
    speeds[:], responses[:] = speed.reshape(rows, LANES), response.reshape(rows, LANES)
    torque_at(speeds, responses, torques)
    torque = torques.reshape(-1).copy()
    return torque, speed + response * torque


def test_torque_and_speed_of_a_sliding_axis_agree() -> None:
    rng = np.random.default_rng(3)
    response = np.exp(rng.uniform(np.log(1e-3), np.log(0.08), 50 * LANES))
    static_change = response * COULOMB * (1 + STATIC)
    speed = rng.choice([-1.0, 1.0], len(response)) * (static_change + rng.uniform(0.01, 1.0, len(response)))
    torque, end = found(speed, response)
    assert np.all(np.abs(end) > SMOOTHING)
    np.testing.assert_array_equal(np.sign(torque), -np.sign(speed))
    np.testing.assert_allclose(np.abs(torque), sliding(end), rtol=2e-3)
    assert np.median(np.abs(np.abs(torque) / sliding(end) - 1)) < 1e-8


def test_an_axis_that_friction_can_stop_is_stopped() -> None:
    rng = np.random.default_rng(4)
    response = rng.uniform(0.01, 0.2, 20 * LANES)
    speed = rng.uniform(-0.9, 0.9, len(response)) * response * COULOMB
    _, end = found(speed, response)
    assert np.max(np.abs(end)) < SMOOTHING
