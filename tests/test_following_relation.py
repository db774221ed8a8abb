"""What two columns are to each other is told at low frequencies, whatever resonates above them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.following import following, relation

RATE_HZ = 20.0
SAMPLES = 2400
MODE_HZ = 1.3


def sweep() -> FloatArray:
    """A command from 0.2 to 5 Hz, with rest at both ends: few of its seconds are below the mode."""
    t = np.arange(SAMPLES) / RATE_HZ
    moving = (t > 2) & (t < 116)
    return np.where(moving, 0.5 * signal.chirp(np.maximum(t - 2, 0), 0.2, 114, 5.0, phi=-90), 0.0)


def held_steps(seed: int) -> FloatArray:
    return np.repeat(np.random.default_rng(seed).normal(0, 0.4, SAMPLES // 24), 24)


def axis(command: FloatArray, gain: float, seed: int) -> FloatArray:
    """Limits, one mode with a damping ratio of 0.05, an integrator, a dead zone and noise."""
    pole = 2 * np.pi * MODE_HZ
    mode = signal.cont2discrete(([pole**2], [1, 0.1 * pole, pole**2]), 1 / RATE_HZ)
    speed = signal.lfilter(np.squeeze(mode[0]), mode[1], gain * np.clip(command, -0.9, 1.0))
    angle = np.cumsum(speed) / RATE_HZ
    angle = np.sign(angle) * np.maximum(np.abs(angle) - 0.01, 0)
    return angle + 0.003 * np.random.default_rng(seed).standard_normal(len(command))


COMMANDS = {"sweep": sweep(), "steps": held_steps(1)}


@pytest.mark.parametrize("kind", COMMANDS)
@pytest.mark.parametrize("gain", [0.2, 1.0])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_every_relation_is_told(kind: str, gain: float, seed: int) -> None:
    u = COMMANDS[kind]
    y = axis(u, gain, seed)
    position = np.cumsum(u) / RATE_HZ
    assert relation(u, y, RATE_HZ) == relation(u, y + 134.2, RATE_HZ) == "follows"
    assert relation(u, -y, RATE_HZ) == "inverted"
    assert relation(y, u, RATE_HZ) == "swapped"
    assert relation(position, y, RATE_HZ) == "derivative"
    assert relation(u, np.gradient(y) * RATE_HZ, RATE_HZ) == "derivative"


@pytest.mark.parametrize("kind", COMMANDS)
def test_gain_is_that_below_the_mode(kind: str) -> None:
    """And that of the rate that is stated, right or wrong."""
    u = COMMANDS[kind]
    y = axis(u, 0.7, 4)
    found = following(u, y, RATE_HZ)
    assert found is not None and found.gain == pytest.approx(0.7, rel=0.25) and found.is_forward
    faster = following(u, y, 10 * RATE_HZ)
    assert faster is not None and faster.gain == pytest.approx(10 * found.gain)


@pytest.mark.parametrize("creep", [0.0, 0.3, -0.3])
def test_beyond_a_mode_an_angle_that_runs_against_its_command_is_not_inverted(creep: float) -> None:
    """A command that holds nearly one frequency, above the mode: its speed is opposed there, and no record at
    lower frequencies says otherwise; nor does an angle that creeps for the rest, either way."""
    t = np.arange(SAMPLES) / RATE_HZ
    u = np.where(t > 2, 0.5 * np.sin(2 * np.pi * 2.0 * (t - 2)) * (1 + 0.5 * np.sin(0.3 * t)), 0.0)
    y = axis(u, 1.0, 7) + creep * np.tanh((t - 40) / 10)
    found = following(u, y, RATE_HZ)
    assert found is not None and found.is_opposed
    assert relation(u, y, RATE_HZ) != "inverted"


def test_a_late_angle_is_not_opposed() -> None:
    """Two seconds late: the phase is taken back to zero frequency."""
    u = COMMANDS["steps"]
    y = np.concatenate([np.zeros(40), axis(u, 1.0, 5)[:-40]])
    assert relation(u, y, RATE_HZ) == "follows"


def test_nothing_is_said_of_what_does_not_follow() -> None:
    drift = np.cumsum(np.random.default_rng(6).standard_normal(SAMPLES))
    for u in COMMANDS.values():
        assert relation(u, drift, RATE_HZ) == "unclear"
        assert relation(u, np.roll(axis(u, 1.0, 7), SAMPLES // 3), RATE_HZ) == "unclear"


def test_a_torque_command_is_not_refused() -> None:
    """Behind it the speed itself lags by a quarter of a turn."""
    u = COMMANDS["steps"]
    y = np.cumsum(np.cumsum(u - 0.02 * np.cumsum(u) / RATE_HZ)) / RATE_HZ**2
    assert relation(u, y, RATE_HZ) in ("follows", "unclear")


def test_short_or_constant_columns_are_not_judged() -> None:
    u = COMMANDS["steps"]
    assert following(u[:100], axis(u, 1.0, 8)[:100], RATE_HZ) is None
    assert following(0 * u, axis(u, 1.0, 8), RATE_HZ) is None


def test_a_long_record_is_averaged_and_tells_the_same() -> None:
    short = following(COMMANDS["steps"], axis(COMMANDS["steps"], 1.0, 9), RATE_HZ)
    long = following(
        np.repeat(COMMANDS["steps"], 40), np.repeat(axis(COMMANDS["steps"], 1.0, 9), 40), 40 * RATE_HZ
    )
    assert short is not None and long is not None
    assert long.gain == pytest.approx(short.gain, rel=0.05)
