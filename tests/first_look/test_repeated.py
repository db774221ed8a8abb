"""Errors that go with the direction of motion or with the angle are told from noise."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter
from simulated_axes import linear_twin, measured

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.hysteresis import directions, hysteresis
from bayes_hw.first_look.look import Look, look
from bayes_hw.first_look.ripple import ripples
from bayes_hw.record import Record, Units

RATE = 50.0
SIGMA = 6e-4


def _follower(u: FloatArray) -> FloatArray:
    """The angle of an axis that follows u with a lag of 0.15 s."""
    speed = np.zeros(len(u))
    for k in range(1, len(u)):
        speed[k] = speed[k - 1] + (u[k - 1] - speed[k - 1]) / (0.15 * RATE)
    return np.cumsum(speed) / RATE


def _strokes(seconds: float = 96) -> FloatArray:
    """Velocity to and fro, slow and fast by turns."""
    t = np.arange(round(seconds * RATE)) / RATE
    return np.asarray(np.sign(np.sin(2 * np.pi * t / 8)) * (0.1 + 0.1 * (t // 16 % 2)))


def _looked(y: FloatArray, u: FloatArray, seed: int = 1) -> Look:
    noise = SIGMA * np.random.default_rng(seed).standard_normal(len(u))
    return look([Record("run", np.arange(len(u)) / RATE, u, y + noise, RATE, Units())])


def test_play_is_shown_and_is_not_noise() -> None:
    u = _strokes()
    seen = _looked(_played(_follower(u), 0.005), u)
    assert seen.repeated.shown_hysteresis is not None
    assert abs(seen.repeated.shown_hysteresis.half_width) == pytest.approx(0.005, rel=0.15)
    assert any("stays behind by 0.00" in item for item in seen.advice.shows)
    assert not any(item.startswith("No dead zone") for item in seen.advice.shows)
    assert seen.noise_sigma == pytest.approx(SIGMA, rel=0.2)


@pytest.mark.slow
def test_axis_without_play_shows_how_little_it_may_have() -> None:
    u = _strokes()
    seen = _looked(_follower(u), u)
    assert seen.repeated.shown_hysteresis is None and seen.repeated.ripples == ()
    said = next(item for item in seen.advice.shows if item.startswith("No dead zone or hysteresis"))
    assert float(said.split("above ")[1].split()[0]) < SIGMA


def test_lag_is_no_hysteresis() -> None:
    u = _strokes()
    motion = _follower(u)
    noise = SIGMA * np.random.default_rng(2).standard_normal(len(u))
    late = hysteresis([motion], [noise - 0.03 * np.gradient(motion) * RATE], RATE, SIGMA)
    assert late is not None and not late.is_clear
    both = hysteresis(
        [motion], [noise - 0.03 * np.gradient(motion) * RATE - 0.005 * directions(motion, 0.01)], RATE, SIGMA
    )
    assert both is not None and both.is_clear
    assert both.half_width == pytest.approx(-0.005, rel=0.05)


def test_strokes_of_one_speed_do_not_tell_lag_from_hysteresis() -> None:
    motion = _follower(np.sin(2 * np.pi * np.arange(6000) / RATE / 8))
    assert hysteresis([motion], [-0.01 * np.gradient(motion) * RATE], RATE, SIGMA) is None


def test_hysteresis_is_seldom_called_where_there_is_none() -> None:
    motion = _follower(_strokes())
    rng = np.random.default_rng(3)
    found = [hysteresis([motion], [SIGMA * rng.standard_normal(len(motion))], RATE, SIGMA) for _ in range(60)]
    scores = [one.half_width / one.standard_error for one in found if one is not None]
    assert len(scores) == 60
    assert np.mean(np.abs(scores) > 2) < 0.1
    inside = [one is not None and abs(one.half_width) < one.bound for one in found]
    assert np.mean(inside) > 0.9


@pytest.mark.slow
@pytest.mark.parametrize("unit", ["deg", "rad"])
def test_cogging_is_shown_and_is_not_noise(unit: str) -> None:
    size = 1.0 if unit == "deg" else np.pi / 180
    u = np.concatenate([np.full(1500, 0.3), np.full(1250, -0.2), np.full(1250, 0.4)])
    y = 10 + _follower(u)
    rippled = y + 0.02 * np.sin(2 * np.pi * y / 2.5 + 0.7)
    noise = SIGMA * np.random.default_rng(4).standard_normal(len(u))
    units = Units(output=unit)
    seen = look([Record("run", np.arange(len(u)) / RATE, u, size * (rippled + noise), RATE, units)])
    (ripple,) = seen.repeated.ripples
    assert ripple.period == pytest.approx(2.5 * size, rel=0.01)
    assert ripple.amplitude == pytest.approx(0.02 * size, rel=0.1)
    said = next(item for item in seen.advice.shows if item.startswith("An error periodic in the angle"))
    assert float(said.split(" to the turn")[0].split()[-1]) == pytest.approx(144, rel=0.01)
    assert seen.noise_sigma < 3 * SIGMA * size


@pytest.mark.parametrize("colour", [0.0, 0.99])
def test_noise_is_no_ripple(colour: float) -> None:
    rng = np.random.default_rng(5)
    angle = _follower(_strokes() + 0.05)
    for _ in range(5):
        error = lfilter([1.0], [1.0, -colour], rng.standard_normal(len(angle)))
        assert ripples([angle], [error], RATE)[0] == ()


def test_error_of_the_command_that_returns_with_every_stroke_is_no_ripple() -> None:
    angle = _follower(_strokes())
    acceleration = np.gradient(np.gradient(angle)) * RATE**2
    noise = SIGMA * np.random.default_rng(6).standard_normal(len(angle))
    assert ripples([angle], [0.1 * acceleration + noise], RATE)[0] == ()


@pytest.mark.slow
def test_linear_axis_has_neither(seed: int = 7) -> None:
    rng = np.random.default_rng(seed)
    t = np.arange(6000) / 20
    u = 0.3 * np.sin(2 * np.pi * (0.01 * t + 0.5 * t**2 / 600))
    seen = look([measured(linear_twin(), u, 1e-3, rng)])
    assert not seen.repeated.is_seen
    assert seen.to_dict()["ripples"] == []


def _played(motion: FloatArray, half_width: float) -> FloatArray:
    output, found = 0.0, np.zeros(len(motion))
    for k, value in enumerate(motion.tolist()):
        output = min(max(output, value - half_width), value + half_width)
        found[k] = output
    return found
