"""A cause whose disturbances come in pulses, or as the axis is used, is refuted; wind is not."""

from __future__ import annotations

import numpy as np
from joint_axis import CASCADE, RATE, SIGMA, STRUCTURE, command, record, response_with, scale
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.decision.joint_calibration import JointCalibration
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.noise.slow_noise import WIND, SlowNoise
from bayes_hw.gap.joint.residuals.own_disturbances import refuting_nats
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 900
REFUTED = JointCalibration.built_in().nats_refuting


def _slowly(disturbances: FloatArray) -> FloatArray:
    """What they move: remembered for some twenty samples, of four times the noise."""
    moved = lfilter([1.0], [1.0, -0.95], disturbances)
    return np.asarray(4 * SIGMA * moved / np.std(moved))


def _nats(disturbances: list[FloatArray], cause: str | None = WIND) -> float:
    response, values = response_with((), SAMPLES)
    records = []
    for seed, moving in enumerate(disturbances, start=1):
        noise = SIGMA * np.random.default_rng(seed).standard_normal(SAMPLES)
        y = response.simulate(values, command(SAMPLES, seed)).y + noise + _slowly(moving)
        records.append(record(y, seed))
    plain = JointResponse(STRUCTURE, (), records, scale(SAMPLES))
    fit = JointFit(plain, evaluate(plain, plain.coordinates(JointValues(CASCADE))))
    return refuting_nats(fit if cause is None else fit.with_cause(SlowNoise(cause, RATE)))


def _normal(seed: int) -> FloatArray:
    return np.random.default_rng(seed).standard_normal(SAMPLES)


def test_wind_is_not_refuted() -> None:
    assert all(_nats([_normal(seed), 1.2 * _normal(seed + 1)]) < 0.6 * REFUTED for seed in (10, 20, 30))


def test_pulses_are_no_wind() -> None:
    rare = [_normal(seed) * (np.random.default_rng(seed).random(SAMPLES) < 0.01) for seed in (11, 12)]
    assert _nats(rare) > REFUTED


def test_what_comes_with_changes_of_the_command_is_no_wind() -> None:
    changing = [np.abs(np.diff(command(SAMPLES, seed), prepend=0.0)) > 0.3 for seed in (1, 2)]
    found = _nats([_normal(seed) * when for seed, when in zip((13, 14), changing, strict=True)])
    assert found > REFUTED


def test_noise_of_no_cause_refutes_nothing() -> None:
    assert _nats([_normal(15), _normal(16)], None) == 0
