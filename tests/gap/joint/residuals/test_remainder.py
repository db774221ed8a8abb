"""What a fit leaves: how well its variance is known, and whether it is the same at all times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, RATE, SIGMA, STRUCTURE, command, measured, record, response_with, scale
from scipy.signal import lfilter

from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.noise.slow_noise import WIND, SlowNoise
from bayes_hw.gap.joint.residuals.remainder import (
    coloured_nats,
    remainder_of,
    samples_of_variance,
)
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate

SAMPLES = 700


def test_the_variance_of_coloured_noise_is_known_worse() -> None:
    """As the spread of the variance over many records says."""
    rng = np.random.default_rng(1)
    records = lfilter([1.0], [1.0, -0.7], rng.standard_normal((400, 2000)), axis=1)[:, 500:]
    spread = np.std(np.mean(records**2, axis=1)) / np.mean(records**2)
    assert abs(np.sqrt(2 / samples_of_variance(list(records[:5]))) * np.sqrt(5) / spread - 1) < 0.15
    white = samples_of_variance([rng.standard_normal(1500)])
    assert 1300 < white <= 1500


def test_what_lasts_longer_than_readings_remember_has_nats() -> None:
    """Of the first order: a correlation of ten seconds has a cause, one of a third of a second is theirs."""
    rng, found = np.random.default_rng(4), []
    clean, values = response_with((), SAMPLES)
    for memory in (0.85, 0.995):
        shown = []
        for seed in (1, 2):
            noise = SIGMA * lfilter([1.0], [1.0, -memory], rng.standard_normal(SAMPLES))
            shown.append(record(clean.simulate(values, command(SAMPLES, seed)).y + noise, seed))
        response = JointResponse(STRUCTURE, (), shown, scale(SAMPLES))
        fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))
        found.append(coloured_nats(fit))
    assert found[0] < 5 < 10 < found[1]


def test_colour_beyond_the_first_order_has_nats_and_noise_of_a_cause_none() -> None:
    rng = np.random.default_rng(3)
    records = measured((), SAMPLES, (1, 2))
    dyed = {
        order: [
            replace(r, y=r.y + 5 * SIGMA * lfilter([1.0], a, rng.standard_normal(SAMPLES))) for r in records
        ]
        for order, a in ((1, [1.0, -0.7]), (4, [1.0, -0.9, 0.0, 0.0, 0.6]))
    }
    response = JointResponse(STRUCTURE, (), dyed[4], scale(SAMPLES))
    fit = JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE))))
    assert coloured_nats(fit) > 100
    response = replace(response, records=dyed[1])
    plain = JointFit(response, evaluate(response, fit.point.coordinates))
    assert coloured_nats(plain) < 5
    caused = fit.with_cause(SlowNoise(WIND, RATE))
    assert remainder_of(caused).coloured == 0 and remainder_of(caused).order == 1
