"""Limits that change at an instant, and play of the command, are told from noise that knows nothing of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, SIGMA, STRUCTURE, command, record, response_with, scale
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.decision.joint_decision import COMMANDED_NATS
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.command_trace import command_nats, last_direction
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 700
INTEGRATING = replace(CASCADE, integrator_residue=0.1)
STRUCTURE_TOO = replace(STRUCTURE, integrator=True)


def _nats(angles: list[FloatArray]) -> float:
    """Of the axis without any change, fitted to noise of up to order 12."""
    records = [record(y, seed) for seed, y in enumerate(angles, start=1)]
    response = JointResponse(STRUCTURE_TOO, (), records, scale(SAMPLES))
    return command_nats(
        JointFit(response, evaluate(response, response.coordinates(JointValues(INTEGRATING))))
    )


def test_limits_that_fall_and_play_are_seen_and_slow_noise_is_not() -> None:
    response, _ = response_with((), SAMPLES)
    response = replace(response, structure=STRUCTURE_TOO)
    values = JointValues(INTEGRATING)
    fallen, played, blown = [], [], []
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
        slow = lfilter([1.0], [1.0, -0.99], 0.05 * SIGMA * rng.standard_normal(SAMPLES))
        blown.append(response.simulate(values, u).y + noise + lfilter([1.0], [1.0, -0.98], slow))
    assert _nats(fallen) > COMMANDED_NATS
    assert _nats(played) > COMMANDED_NATS
    assert _nats(blown) < 0.2 * COMMANDED_NATS


def test_the_last_direction_is_kept_while_a_command_is_held() -> None:
    held = last_direction(np.array([0.0, 0.0, 0.2, 0.2, 0.1, 0.1, 0.1, 0.3]))
    assert held.tolist() == [0, 0, 1, 1, -1, -1, -1, 1]
