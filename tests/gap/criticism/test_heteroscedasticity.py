"""Slow noise that is as strong everywhere, and such that is not."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import RATE, command
from drive_axis import SIGMA as AXIS_SIGMA
from fitted import base, with_residuals
from simulated_records import coloured_noise

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.free_functions import Motion, motions
from bayes_hw.gap.criticism.heteroscedasticity import CHANGED_S, FREED_S, regimes_of, steadiness, unevenness
from bayes_hw.gap.noise.state_noise import walking_noise

SAMPLES = 1500
SIGMA, STEP = 0.05, 0.05
LIMIT = 0.3


def motion(seed: int) -> Motion:
    u = command(SAMPLES, seed)
    limited = np.clip(u, -LIMIT, LIMIT)
    w = np.cumsum(limited) / RATE
    return Motion(u, limited, w, np.gradient(w) * RATE)


MOTIONS = [motion(seed) for seed in (1, 2)]
REGIMES = regimes_of(MOTIONS, RATE)
NOISE = walking_noise(SIGMA, 0.3, STEP)


def wandering(seed: int, strengths: list[FloatArray]) -> list[FloatArray]:
    """A walk whose increments have `strengths` times the variance of NOISE, with its encoder noise."""
    rng = np.random.default_rng(seed)
    found = []
    for strength in strengths:
        steps = STEP * np.sqrt(strength) * rng.normal(size=SAMPLES)
        encoder = coloured_noise(SAMPLES, SIGMA, 0.3, rng)
        found.append(np.concatenate([[0.0], np.cumsum(steps)[:-1]]) + encoder)
    return found


def test_regimes_are_what_the_axis_does() -> None:
    """All of them occur, none is always true; after a limit begins where the limit ends."""
    assert set(REGIMES) == {"at a limit", "after a limit", "after a change of the command", "at speed"}
    for masks in REGIMES.values():
        assert 0.02 < np.mean(np.concatenate(masks)) < 0.98
    at, after = REGIMES["at a limit"][0], REGIMES["after a limit"][0]
    ends = np.flatnonzero(at[:-1] & ~at[1:]) + 1
    assert after[ends].all()
    quiet = np.ones(SAMPLES, dtype=bool)
    for end in ends:
        quiet[end : end + int(FREED_S * RATE) + 1] = False
    assert not after[quiet].any()
    steps = Motion(*(np.where(np.arange(100) < 50, 0.0, 1.0) for _ in range(4)))
    (changed,) = regimes_of([steps], RATE)["after a change of the command"]
    np.testing.assert_array_equal(np.flatnonzero(changed), 50 + np.arange(int(CHANGED_S * RATE) + 1))


def test_even_noise_is_no_surprise() -> None:
    """The surprise is that of a probability: over many records a twentieth exceeds that of one in twenty."""
    found = [
        unevenness(NOISE, wandering(seed, [np.ones(SAMPLES)] * 2), REGIMES).negative_log_p
        for seed in range(60)
    ]
    assert np.mean(np.array(found) > -np.log(0.05)) < 0.15
    assert max(found) < 9


@pytest.mark.parametrize("regime", ["after a limit", "at speed"])
@pytest.mark.parametrize("times", [4.0, 0.25])
def test_what_comes_of_the_command_is_uneven(regime: str, times: float) -> None:
    """Four times the variance in one regime, or a quarter: found there."""
    strengths = [np.where(mask, times, 1.0) for mask in REGIMES[regime]]
    found = unevenness(NOISE, wandering(5, strengths), REGIMES)
    assert found.regime == regime
    assert found.negative_log_p > 15
    assert 0.5 < found.share < 0.9


def test_nothing_is_told_of_regimes_that_do_not_occur() -> None:
    never = {"never": [np.zeros(SAMPLES, dtype=bool)] * 2}
    assert unevenness(NOISE, wandering(1, [np.ones(SAMPLES)] * 2), never) == ("", 0.0, 0.0)


def test_a_windier_record_is_no_regime() -> None:
    """Four times the variance in one record of two, whatever the axis does there."""
    strengths = [np.full(SAMPLES, 0.5), np.full(SAMPLES, 2.0)]
    mostly = {"mostly in one": [np.arange(SAMPLES) % 10 < 1, np.arange(SAMPLES) % 10 < 8]}
    assert unevenness(NOISE, wandering(3, strengths), mostly).negative_log_p < 5


def steady_or_not(added: FloatArray, seed: int = 3) -> float:
    """The surprise of a constant command where this is added to the command of an axis, in nats."""
    rng = np.random.default_rng(seed)
    inputs = [command(SAMPLES, record) for record in range(2)]
    found = base(SAMPLES)
    chain = found.chain(found.builder.axis.nominal)
    clean = with_residuals([np.zeros(SAMPLES)] * 2, found)
    moved = motions(clean, inputs)
    shown = [m.shown(chain.small_responses("command", added[:, None]))[:, 0] for m in moved]
    size = 2 * AXIS_SIGMA / np.std(np.concatenate(shown))
    residuals = [size * own + AXIS_SIGMA * rng.normal(size=SAMPLES) for own in shown]
    return steadiness(with_residuals(residuals, found), moved).negative_log_p


def test_a_constant_force_is_steady_and_gusts_are_not() -> None:
    """Both of twice the noise."""
    t = np.arange(SAMPLES) / RATE
    gusty = np.cumsum(np.random.default_rng(5).normal(size=SAMPLES)) + 20 * np.sin(2 * np.pi * t / 20)
    assert steady_or_not(np.ones(SAMPLES)) > 20
    assert steady_or_not(gusty - gusty.mean()) < 5
