"""Reversals counted, slews told from tracking, speed against command, error against angle."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.distortion import distortion
from bayes_hw.first_look.feedback import feedback
from bayes_hw.first_look.motion import position_error, regimes, reversals, speed_map


def test_reversals_deeper_than_the_threshold() -> None:
    t = np.arange(4000) / 20
    y = np.sin(2 * np.pi * 0.05 * t) + 0.01 * np.random.default_rng(1).standard_normal(4000)
    assert reversals(y, 0.1) == 20
    assert reversals(np.linspace(0, 1, 100), 0.1) == 0


def test_slew_tracking_and_rest() -> None:
    u = np.concatenate([np.zeros(400), np.full(400, 1.0), np.full(800, 0.01), np.zeros(400)])
    moved = np.cumsum(u) / 20
    late = np.convolve(moved, np.exp(-np.arange(200) / 20) / 20, mode="full")[: len(u)]
    y = late + 0.002 * np.random.default_rng(2).standard_normal(len(u))
    found = regimes([y], [u], 20.0, 0.002)
    assert (found["slew"].stretches, found["tracking"].stretches, found["rest"].stretches) == (1, 1, 2)
    assert found["tracking"].error_rms == pytest.approx(0.002, rel=0.1)
    settling = found["tracking"].settling_s
    assert settling is not None
    assert 3 < settling < 7


def test_speed_shows_limits_and_direction() -> None:
    rng = np.random.default_rng(3)
    u = np.sin(np.arange(8000) / 200)
    y = np.cumsum(np.clip(u, -0.5, 0.6) + 0.1 * (np.gradient(u) < 0)) / 20 + 1e-4 * rng.standard_normal(8000)
    found = speed_map([y], [u], 20.0, 0.0)
    assert np.nanmax(found.rising) == pytest.approx(0.6, abs=0.02)
    assert np.nanmin(found.rising) == pytest.approx(-0.5, abs=0.02)
    assert found.hysteresis == pytest.approx(0.1 / 0.7, abs=0.02)


def test_error_that_repeats_with_the_angle() -> None:
    rng = np.random.default_rng(4)
    y = 180 + 170 * np.sin(np.arange(40_000) / 800)
    error = 0.01 * np.sin(np.deg2rad(6 * y)) + 0.003 * rng.standard_normal(len(y))
    found = position_error([y], [error], 360.0)
    assert np.nanmax(found.mean) - np.nanmin(found.mean) == pytest.approx(0.02, rel=0.15)


def test_even_and_odd_distortion_are_told_apart() -> None:
    rng = np.random.default_rng(5)
    u = rng.standard_normal(4000)
    for nonlinear, name in ((np.abs(u), "even"), (u * np.abs(u) - 1.6 * u, "odd")):
        error = np.cumsum(nonlinear - nonlinear.mean() + 0.5 * rng.standard_normal(4000))
        found = distortion([error], [u], 20.0)
        assert found is not None
        other = found.odd if name == "even" else found.even
        assert getattr(found, name) > 0.3
        assert other < 0.05


def test_closed_loop_shows_and_open_loop_does_not() -> None:
    rng = np.random.default_rng(6)
    noise = np.zeros(6000)
    for k in range(1, 6000):
        noise[k] = 0.7 * noise[k - 1] + rng.standard_normal()
    drive = rng.standard_normal(6000)
    loop = drive - 0.5 * np.append(np.zeros(2), noise[:-2])
    closed, opened = (feedback([noise], [u], 20.0, [np.zeros(6000)]) for u in (loop, drive))
    assert closed is not None and opened is not None
    assert closed.closed_loop
    assert not opened.closed_loop


def driven(loop: bool, seed: int, samples: int = 4000, rate: float = 200.0) -> tuple[FloatArray, FloatArray]:
    """Command, an acceleration, and angle of a mass with dry friction: of a drive that measures the
    angle with its noise, or of the same commands played from a file."""
    rng = np.random.default_rng(seed)
    t = np.arange(samples) / rate
    at = np.arange(round(t[-1]) + 2.0)
    reference = np.interp(t, at, np.cumsum(rng.standard_normal(len(at))))
    noise = 2e-3 * rng.standard_normal((2, samples))
    u, y = np.zeros(samples), np.zeros(samples)
    for kind in (0, 1):  # the second time with the first's commands
        angle = speed = 0.0
        for k in range(samples):
            y[k] = angle + noise[kind, k]
            if kind == 0 and k > 1:
                u[k] = 60 * (reference[k] - y[k - 1]) - 3 * (y[k - 1] - y[k - 2]) * rate
            moved = speed + u[k] / rate
            speed = np.sign(moved) * max(abs(moved) - 1.0 / rate, 0.0)
            angle += speed / rate
        if loop:
            break
    return u, y


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_drive_that_measures_the_angle_itself_is_a_loop(seed: int) -> None:
    """Errors of a linear response hide it, friction being far beyond the noise; the same torques without the
    loop are none."""
    for loop in (True, False):
        u, y = driven(loop, seed)
        unseen = np.random.default_rng(seed).standard_normal(len(u))
        found = feedback([unseen], [u], 200.0, [y])
        assert found is not None
        assert found.closed_loop == loop
        assert (found.heard > 0.2) if loop else (found.heard < 0.03)


def test_friction_under_a_sweep_is_no_loop() -> None:
    """Errors that follow the command's sign: a sweep knows them before they come."""
    t = np.arange(6000) / 25
    sweep = np.sin(2 * np.pi * (0.05 + 0.02 * t) * t)
    friction = np.convolve(np.sign(sweep), np.exp(-np.arange(50) / 8))[:6000]
    found = feedback(
        [friction + 0.02 * np.random.default_rng(1).standard_normal(6000)], [sweep], 25.0, [np.zeros(6000)]
    )
    assert found is not None
    assert abs(found.correlation) > 0.1
    assert not found.closed_loop
