"""A command that moves an angle is told behind delays, limits and noise; chance and wandering are not."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.integral_regression import BY_CHANCE_NATS, integral_regression, level_regression
from bayes_hw.record_checks import related

RATE_HZ = 100.0
SAMPLES = 1500


def command(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.repeat(rng.normal(size=SAMPLES // 30), 30)


def angle(u: FloatArray, delay: int, noise: float, seed: int) -> FloatArray:
    late = np.concatenate([np.zeros(delay), u[: len(u) - delay]])
    return np.cumsum(late) / RATE_HZ + noise * np.random.default_rng(seed).normal(size=len(u))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_gain_and_sign_behind_a_delay(sign: float) -> None:
    u = command(1)
    found = integral_regression(u, 2.5 * sign * angle(u, 80, 0.0, 2), RATE_HZ)
    assert found.correlation == pytest.approx(sign, abs=0.05)
    assert found.gain == pytest.approx(2.5 * sign, rel=0.1)


def test_a_position_is_told_from_a_speed() -> None:
    u = command(1)
    late = np.concatenate([np.zeros(40), u[:-40]])
    assert (
        level_regression(u, late).correlation > 0.99 > 0.9 > integral_regression(u, late, RATE_HZ).correlation
    )


@pytest.mark.parametrize("seed", range(4))
def test_a_short_noisy_record_behind_a_long_delay_is_not_refused(seed: int) -> None:
    """Spectra of its eighths have lost their coherence to a delay of half their length."""
    u = command(seed)
    y = angle(u, 90, 0.01, seed + 10)
    assert integral_regression(u, y, RATE_HZ).is_moved
    assert related(u, y, RATE_HZ) is None


@pytest.mark.parametrize("kind", ["white", "walk", "both"])
def test_what_the_command_does_not_move_gains_by_chance_alone(kind: str) -> None:
    """Past commands gain fewer nats than BY_CHANCE_NATS in each of forty records."""
    gained = []
    for seed in range(40):
        white = np.random.default_rng([7, seed]).normal(size=SAMPLES)
        y = {"white": white, "walk": white.cumsum(), "both": 0.1 * white.cumsum() + white[::-1]}[kind]
        gained.append(integral_regression(command(seed), y, RATE_HZ).nats)
    assert max(gained) < BY_CHANCE_NATS
    assert np.median(gained) < 10


def test_an_axis_whose_drive_was_off_is_unrelated() -> None:
    found = related(command(3), np.random.default_rng(8).normal(size=SAMPLES), RATE_HZ)
    assert found is not None and found.kind == "unrelated"
