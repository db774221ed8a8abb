"""What is left: nothing in noise, the right kind where there is structure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import RATE, SIGMA, coloured, command, hypothesis, white
from fitted import AXIS, SAMPLES, base, explained, noisy, of_records, with_residuals
from scipy import signal
from scipy.interpolate import CubicSpline

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.calibration import Calibration
from bayes_hw.gap.criticism.residual_diagnostics import UNSTATED_NOISE, residual_diagnostics
from bayes_hw.gap.fit.explanation import with_stochastic
from bayes_hw.gap.noise.clock_jitter import clock_jitter
from bayes_hw.gap.noise.slow_noise import random_walk

INPUTS = [command(SAMPLES, seed) for seed in range(2)]
T = np.arange(SAMPLES) / RATE
TRIFLE = Calibration.built_in().left_surprise
"""Surprise below which a leftover counts for nothing."""


def noise(seed: int = 0) -> list[FloatArray]:
    return [white(SAMPLES, SIGMA, 2 * seed + record) for record in range(2)]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("correlation", [0.0, 0.8])
def test_noise_leaves_nothing(seed: int, correlation: float) -> None:
    """White or first-order noise: no description gains what would count."""
    residuals = [coloured(SAMPLES, SIGMA, correlation, 100 + 2 * seed + r) for r in range(2)]
    left = residual_diagnostics(explained(residuals), INPUTS)
    assert left == sorted(left, key=lambda item: -item.negative_log_p)
    assert left[0].negative_log_p < 0.5 * TRIFLE, left[0]


def test_a_sine_is_a_line_in_time() -> None:
    """Its size in units of the residual, whatever its phase in each record."""
    residuals = [e + SIGMA * np.sin(2 * np.pi * 0.83 * T + r) for r, e in enumerate(noise())]
    found = {item.kind: item for item in residual_diagnostics(explained(residuals), INPUTS)}
    line = found["line in time"]
    assert line.negative_log_p > 3 * TRIFLE
    assert line.size == pytest.approx(np.sqrt(0.5 / 1.5), rel=0.1)
    assert line.negative_log_p > found["step"].negative_log_p


def test_a_jump_is_a_step() -> None:
    """One lasting jump of five sigma a record, and the share of the residual that it makes."""
    jumps = [np.where(20 + 5 * r < T, 5 * SIGMA, 0.0) for r in range(2)]
    residuals = [e + jump for e, jump in zip(noise(1), jumps, strict=True)]
    best = residual_diagnostics(explained(residuals), INPUTS)
    step = next(item for item in best if item.kind == "step")
    assert step.negative_log_p > TRIFLE
    share = np.mean([np.var(jump) for jump in jumps]) / np.mean(np.concatenate(residuals) ** 2)
    assert step.size == pytest.approx(np.sqrt(share), rel=0.15)


def test_a_fast_move_between_untimely_samples_is_no_step() -> None:
    """The local mean then changes as the spread does; a lasting jump at rest still counts."""
    moving = [np.where((T > 30) & (T < 32), 60 * SIGMA * (T - 30) ** 2, 0.0) for _ in range(2)]
    moving = [np.maximum.accumulate(y) for y in moving]
    found = {}
    for jump in (0.0, 5 * SIGMA):
        rng = np.random.default_rng(9)
        untimely = [CubicSpline(T, y)(T + rng.normal(0, 0.03, SAMPLES)) - y for y in moving]
        residuals = [e + d + np.where(T > 15, jump, 0.0) for e, d in zip(noise(5), untimely, strict=True)]
        fit = replace(with_residuals(residuals), simulated=moving)
        jitter = clock_jitter(fit)
        assert jitter is not None
        left = residual_diagnostics(with_stochastic(jitter, fit), INPUTS)
        found[jump] = next(item for item in left if item.kind == "step")
    assert found[0.0].negative_log_p == 0
    assert found[5 * SIGMA].negative_log_p > TRIFLE


def test_a_resonance_is_a_spectrum() -> None:
    """Second-order noise that first-order noise cannot be."""
    pole = 0.97 * np.exp(2j * np.pi * 1.7 / RATE)
    residuals = [
        e + signal.lfilter([1.0], np.real(np.poly([pole, pole.conjugate()])), 0.3 * f)
        for e, f in zip(noise(2), noise(3), strict=True)
    ]
    found = {item.kind: item for item in residual_diagnostics(explained(residuals), INPUTS)}
    assert found["spectrum"].negative_log_p > 3 * TRIFLE
    assert found["spectrum"].size > 0.35


def test_an_error_that_follows_the_motion_is_a_function() -> None:
    """An even function of the position, which no base parameter makes."""
    explanation = explained(noise(4))
    simulated = explanation.fit.simulated
    shape = [np.cos(2 * np.pi * y / np.ptp(y)) for y in simulated]
    residuals = [e + SIGMA * s for e, s in zip(noise(4), shape, strict=True)]
    found = {item.kind: item for item in residual_diagnostics(explained(residuals), INPUTS)}
    assert found["function at sensor"].negative_log_p > TRIFLE
    assert 0.7 < found["function at sensor"].size / np.sqrt(0.5) < 1.1


def test_known_glitches_are_bridged_first() -> None:
    """Outliers that the explanation has named are not found again."""
    from bayes_hw.gap.noise.glitches import outliers

    rng, residuals = np.random.default_rng(3), noise(5)
    for e in residuals:
        e[rng.choice(SAMPLES, 20, replace=False)] += 40 * SIGMA * rng.choice([-1, 1], 20)
    plain = explained(residuals)
    found = outliers(plain.fit)
    assert found is not None
    named = replace(plain, stochastic=found, fit=replace(plain.fit, whitener=found.whitener))
    assert residual_diagnostics(named, INPUTS)[0].negative_log_p < 0.5 * TRIFLE


def test_a_walk_that_follows_the_limits_leaves_gusts() -> None:
    """An encoder that wanders five times as fast where the command is beyond a limit; one that always wanders
    alike leaves nothing."""
    found = {}
    for times in (1.0, 25.0):
        residuals = []
        for record, u in enumerate(INPUTS):
            rng = np.random.default_rng(60 + record)
            at_limit = (u < AXIS.saturation.lower) | (u > AXIS.saturation.upper)
            steps = 0.2 * SIGMA * np.where(at_limit, np.sqrt(times), 1.0) * rng.normal(size=SAMPLES)
            residuals.append(white(SAMPLES, SIGMA, 40 + record) + np.cumsum(steps))
        fit = with_residuals(residuals)
        walk = random_walk(fit)
        assert walk is not None
        left = residual_diagnostics(with_stochastic(walk, fit), INPUTS)
        found[times] = next(item for item in left if item.kind.startswith("gusts"))
    assert found[1.0].negative_log_p < 0.5 * TRIFLE
    assert found[25.0].negative_log_p > TRIFLE and "limit" in found[25.0].kind
    assert found[25.0].size > 0.5


def test_noise_above_the_stated_is_left() -> None:
    """2.6 times as much counts, its size what the stated does not hold; a fifth more, or less, does not.

    The fitted `left_surprise` of 22.7 nats lies at 2.4 times, for a noise known to 13 %; 2.2 times as much
    is as surprising as it was when 18 nats counted.
    """
    for times, least, counts in (
        (2.6, TRIFLE, True),
        (2.2, 18.0, True),
        (1.2, 18.0, False),
        (0.5, 18.0, False),
    ):
        residuals = [times * e for e in noise(3)]
        found = {item.kind: item for item in residual_diagnostics(explained(residuals), INPUTS, SIGMA)}
        unstated = found[UNSTATED_NOISE]
        assert (unstated.negative_log_p > least) == counts
        if counts:
            assert unstated.size == pytest.approx(np.sqrt(1 - times**-2), rel=0.05)
    assert UNSTATED_NOISE not in {item.kind for item in residual_diagnostics(explained(noise(3)), INPUTS)}


def test_coarse_steps_of_the_command_show_through_a_walk() -> None:
    """A converter of few bits looks like a wandering encoder; seven knots over the command are too few."""
    step = 0.3 * AXIS.saturation.upper
    rounded = [step * np.round(u / step) for u in INPUTS]
    clean = hypothesis(AXIS, rounded).simulate(base().builder.axis.nominal)
    fit = of_records(noisy(clean), base())
    walk = random_walk(fit)
    assert walk is not None
    found = {item.kind: item for item in residual_diagnostics(with_stochastic(walk, fit), INPUTS)}
    detail = found["function at input in detail"]
    assert detail.negative_log_p > TRIFLE and detail.size > 0.5
    assert found["function at input"].negative_log_p < 0.5 * detail.negative_log_p


@pytest.mark.parametrize("seed", range(3))
def test_a_walk_as_it_is_leaves_nothing(seed: int) -> None:
    """That noise may be weaker gains nothing where it is what it is said to be."""
    rng = np.random.default_rng(80 + seed)
    residuals = [e + np.cumsum(0.4 * SIGMA * rng.normal(size=SAMPLES)) for e in noise(90 + seed)]
    fit = with_residuals(residuals)
    walk = random_walk(fit)
    assert walk is not None
    assert residual_diagnostics(with_stochastic(walk, fit), INPUTS)[0].negative_log_p < 0.5 * TRIFLE


def test_a_gain_that_jumps_shows_through_a_walk() -> None:
    """The output strays from where the gain has changed, as an encoder that wanders would."""
    jumped = [np.where(25 + 10 * r > T, u, 1.02 * u) for r, u in enumerate(INPUTS)]
    clean = hypothesis(AXIS, jumped).simulate(base().builder.axis.nominal)
    fit = of_records(noisy(clean), base())
    walk = random_walk(fit)
    assert walk is not None
    found = {item.kind: item for item in residual_diagnostics(with_stochastic(walk, fit), INPUTS)}
    changed = found["function of the gain over time"]
    assert changed.negative_log_p > TRIFLE and changed.size > 0.5
