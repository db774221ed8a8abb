"""Friction's shapes: the motor's own speed, and what turns where it does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from drive_axis import MOTOR_ANGLE, RATE, TRAIN, V, command, held
from fitted import AXIS, SAMPLES, base, with_residuals
from scipy.ndimage import binary_erosion

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.free_functions import Motion, motions
from bayes_hw.gap.criticism.friction_shapes import motions_of_the_motor, shapes_of_friction
from bayes_hw.gap.simulate.chain_builder import ChainBuilder

INPUTS = [command(SAMPLES, seed) for seed in range(2)]
CHAIN = ChainBuilder(AXIS).chain(ChainBuilder(AXIS).axis.nominal)


def angle_of_the_motor(limited: FloatArray) -> FloatArray:
    """By the state space of the drive train under the same held commands."""
    a, b, c = TRAIN.state_space()
    ad, bd = held(a, b[:, [V]], 1 / RATE)
    angle, x = np.empty(len(limited)), np.zeros(7)
    for k, u in enumerate(limited):
        angle[k] = c[MOTOR_ANGLE] @ x
        x = ad @ x + bd[:, 0] * u
    return angle


def test_the_motor_moves_as_in_state_space() -> None:
    """Its speed, where the encoder sees the motion of the load; that differs from the load's."""
    found = motions(with_residuals([np.zeros(SAMPLES)] * 2), INPUTS)
    for load, motor in zip(found, motions_of_the_motor(found, CHAIN, base().scale), strict=True):
        expected = np.gradient(angle_of_the_motor(load.limited)) * RATE
        seen = np.ones(SAMPLES, dtype=bool) if load.seen is None else binary_erosion(load.seen)
        assert np.mean(seen) > 0.7
        error = np.abs(motor.speed - expected)[seen]
        assert np.max(error) < 1e-2 * np.max(np.abs(expected))
        assert np.max(np.abs(load.speed - expected)[seen]) > 5 * np.max(error)


def test_friction_turns_with_the_speed() -> None:
    """Every shape changes its sign with the motion but for splines, which change places; no motion, no
    sign."""
    rng = np.random.default_rng(3)
    speed = np.repeat(rng.normal(size=40), 10)
    one = Motion(speed, speed, np.cumsum(speed), speed)
    there = shapes_of_friction([one], RATE)[0]
    back = shapes_of_friction([replace(one, speed=-speed)], RATE)[0]
    assert there.shape == back.shape and len(there) == len(speed)
    np.testing.assert_array_equal(there[:, 0], np.sign(speed))
    np.testing.assert_array_equal(back[:, 0], -there[:, 0])
    np.testing.assert_allclose(back[:, 1:8], there[:, 7:0:-1], atol=1e-12)
    np.testing.assert_allclose(back[:, 8:], -there[:, 8:], atol=1e-12)
    np.testing.assert_allclose(there[:, 1:8].sum(axis=1), 1.0)
