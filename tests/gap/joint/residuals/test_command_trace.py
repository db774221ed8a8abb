"""Limits that change at an instant, and play of the command, are told from noise that knows nothing of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, SIGMA, STRUCTURE, command, record, response_with, scale
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.command_trace import command_nats, last_direction
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 700
REFUTED = JointCalibration.built_in().nats_refuting
INTEGRATING = replace(CASCADE, integrator_residue=0.1)
STRUCTURE_TOO = replace(STRUCTURE, integrator=True)


def _nats(angles: list[FloatArray]) -> float:
    """Of the axis without any change, fitted to noise of up to order 12."""
    records = [record(y, seed) for seed, y in enumerate(angles, start=1)]
    response = JointResponse(STRUCTURE_TOO, (), records, scale(SAMPLES))
    return command_nats(
        JointFit(response, evaluate(response, response.coordinates(JointValues(INTEGRATING))))
    )


def _at_rest() -> tuple[JointResponse, JointValues]:
    response, _ = response_with((), SAMPLES)
    return replace(response, structure=STRUCTURE_TOO), JointValues(INTEGRATING)


def test_limits_that_fall_and_play_are_seen() -> None:
    response, values = _at_rest()
    fallen, played = [], []
    for seed, instant in ((1, 200), (2, 450)):
        rng, u = np.random.default_rng(seed), command(SAMPLES, seed)
        noise = SIGMA * rng.standard_normal(SAMPLES)
        derated = np.where(np.arange(SAMPLES) < instant, u, np.clip(u, -0.9 * 0.35, 0.9 * 0.3))
        fallen.append(response.simulate(values, derated).y + noise)
        behind = np.empty(SAMPLES)
        kept = 0.0
        for k, asked in enumerate(u):
            kept = behind[k] = min(max(kept, asked - 0.02), asked + 0.02)
        played.append(response.simulate(values, behind).y + noise)
    assert _nats(fallen) > 5 * REFUTED
    assert _nats(played) > 4 * REFUTED


def test_limits_that_have_another_delay_are_seen() -> None:
    """What comes half a sample sooner, or later, where the command is at a limit moves the axis for good."""
    response, values = _at_rest()
    for share in (-0.5, 0.5):
        angles = []
        for seed in (1, 2):
            u = command(SAMPLES, seed)
            limited = np.clip(u, -0.35, 0.3)
            sooner = np.where(limited == u, 0.0, share * np.diff(limited, prepend=0.0))
            noise = SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)
            within = replace(values, cascade=replace(values.cascade, lower=-np.inf, upper=np.inf))
            angles.append(response.simulate(within, limited + sooner).y + noise)
        assert _nats(angles) > 5 * REFUTED


def test_slow_noise_knows_nothing_of_the_command() -> None:
    response, values = _at_rest()
    rng = np.random.default_rng(3)

    def blown(seed: int) -> FloatArray:
        slow = lfilter([1.0], [1.0, -0.99], 0.05 * SIGMA * rng.standard_normal(SAMPLES))
        noise = SIGMA * rng.standard_normal(SAMPLES) + lfilter([1.0], [1.0, -0.98], slow)
        return np.asarray(response.simulate(values, command(SAMPLES, seed)).y + noise)

    found = [_nats([blown(1), blown(2)]) for _ in range(30)]
    assert max(found) < REFUTED
    assert np.mean(np.array(found) > 0.4 * REFUTED) < 0.1


def test_the_last_direction_is_kept_while_a_command_is_held() -> None:
    held = last_direction(np.array([0.0, 0.0, 0.2, 0.2, 0.1, 0.1, 0.1, 0.3]))
    assert held.tolist() == [0, 0, 1, 1, -1, -1, -1, 1]
