"""Heavy tails of the innovations are seen where they are, and change nothing where they are not."""

from __future__ import annotations

import numpy as np
from joint_axis import CASCADE, SIGMA, STRUCTURE, command, record, response_with, scale

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.heavy_tails import tails_of, with_heavy_tails
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate

SAMPLES, ASKED = 700, 25.0


def _fit(noises: list[FloatArray]) -> JointFit:
    clean, values = response_with((), SAMPLES)
    shown = [
        record(clean.simulate(values, command(SAMPLES, seed)).y + noise, seed)
        for seed, noise in enumerate(noises, start=1)
    ]
    response = JointResponse(STRUCTURE, (), shown, scale(SAMPLES))
    return JointFit(response, evaluate(response, response.coordinates(JointValues(CASCADE)))).descended()


def test_normal_noise_stays_normal() -> None:
    rng = np.random.default_rng(1)
    fit = _fit([SIGMA * rng.standard_normal(SAMPLES) for _ in range(2)])
    assert tails_of(fit)[0] < 0
    assert with_heavy_tails(fit, ASKED) is fit


def test_noise_of_student_t_is_taken_for_what_it_is() -> None:
    rng = np.random.default_rng(2)
    fit = _fit([SIGMA * rng.standard_t(3, SAMPLES) for _ in range(2)])
    nats, degrees = tails_of(fit)
    assert nats > ASKED
    assert 2 <= degrees <= 4
    heavy = with_heavy_tails(fit, ASKED)
    assert heavy.has_heavy_tails
    assert heavy.score > fit.score + ASKED
    assert "heavy tails" in heavy.said_of_g()[-1]
    again = heavy.moved(heavy.structure, heavy.values)
    assert again.has_heavy_tails


def test_what_rounding_makes_is_no_heavy_tail() -> None:
    """Readings of large steps rest, and then step; where more is left than that, tails are tails."""
    step = 40 * SIGMA
    clean, values = response_with((), SAMPLES)
    rounded = []
    for seed in (1, 2):
        angle = clean.simulate(values, command(SAMPLES, seed)).y
        rounded.append(step * np.round(angle / step) - angle)
    fit = _fit(rounded)
    assert tails_of(fit)[0] > ASKED
    assert with_heavy_tails(fit, ASKED, step) is fit
    assert with_heavy_tails(fit, ASKED, 0.2 * step).has_heavy_tails


def test_tails_of_some_samples_are_those_of_no_others() -> None:
    """Large errors in the second half of every record show there and not in the first."""
    rng, half = np.random.default_rng(3), np.arange(SAMPLES) < SAMPLES // 2
    noises = [SIGMA * rng.standard_normal(SAMPLES) for _ in range(2)]
    fit = _fit([np.where(half, e, SIGMA * rng.standard_t(3, SAMPLES)) for e in noises])
    assert tails_of(fit)[0] > ASKED
    assert tails_of(fit, [half, half])[0] < 0
    assert tails_of(fit, [~half, ~half])[0] > ASKED
