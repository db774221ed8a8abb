"""A change of the limits at an instant is told from noise that knows nothing of the command."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, SIGMA, STRUCTURE, command, record, response_with, scale
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.decision.joint_decision import CHANGED_NATS
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.change_in_time import change_nats
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
    return change_nats(JointFit(response, evaluate(response, response.coordinates(JointValues(INTEGRATING)))))


def test_limits_that_fall_are_seen_and_slow_noise_is_not() -> None:
    response, _ = response_with((), SAMPLES)
    response = replace(response, structure=STRUCTURE_TOO)
    values = JointValues(INTEGRATING)
    fallen, blown = [], []
    for seed, instant in ((1, 200), (2, 450)):
        rng, u = np.random.default_rng(seed), command(SAMPLES, seed)
        noise = SIGMA * rng.standard_normal(SAMPLES)
        derated = np.where(np.arange(SAMPLES) < instant, u, np.clip(u, -0.9 * 0.35, 0.9 * 0.3))
        fallen.append(response.simulate(values, derated).y + noise)
        slow = lfilter([1.0], [1.0, -0.99], 0.05 * SIGMA * rng.standard_normal(SAMPLES))
        blown.append(response.simulate(values, u).y + noise + lfilter([1.0], [1.0, -0.98], slow))
    assert _nats(fallen) > CHANGED_NATS
    assert _nats(blown) < 0.2 * CHANGED_NATS
