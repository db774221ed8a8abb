"""Angles that were held are found beneath fresh noise, and nothing else is taken for them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lfilter

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.noise.held_angles import held_angles


def _swing(samples: int) -> FloatArray:
    """An angle that is fast now and then, output units of its noise."""
    time = np.arange(samples)
    return 400 * np.sin(2 * np.pi * time / 300) * np.sin(2 * np.pi * time / 1700)


@pytest.mark.parametrize("share", [0.04, 0.1, 0.25, 0.4])
def test_angles_held_beneath_fresh_noise_are_found(share: float) -> None:
    """Their share, but for those held for longer, and which they are where the axis moves by many times the
    noise; not their readings but their angles repeat, so that no reading does."""
    rng = np.random.default_rng(9)
    angle = _swing(4000)
    kept = rng.random(4000) < share
    kept[0] = False
    shown = angle[np.maximum.accumulate(np.where(kept, 0, np.arange(4000)))] + rng.standard_normal(4000)
    found = held_angles([shown - angle], [angle], 0.0)
    assert found.present
    assert found.share == pytest.approx(float(np.mean(kept)), rel=0.25)
    fast = np.abs(np.gradient(angle)) > 6
    assert np.mean(found.masks[0][fast] == kept[fast]) > 0.92


def test_an_angle_held_for_long_is_found() -> None:
    """Of angles that are held by chance a few are held for many samples; what steps back that far is told
    from slow noise by the others."""
    rng = np.random.default_rng(12)
    angle = _swing(6000)
    kept = rng.random(6000) < 0.4
    kept[0] = False
    since = np.arange(6000) - np.maximum.accumulate(np.where(kept, 0, np.arange(6000)))
    shown = angle[np.arange(6000) - since] + rng.standard_normal(6000)
    found = held_angles([shown - angle], [angle], 0.0)
    long = (since > 3) & (np.abs(np.gradient(angle)) > 3)
    assert np.sum(long) > 40
    assert np.mean(found.masks[0][long]) > 0.9


@pytest.mark.parametrize("kind", ["noise", "glitches", "jitter", "late", "coloured"])
def test_nothing_else_is_an_angle_held(kind: str) -> None:
    """Glitches either way, instants that are off either way, a constant lag, and slow errors are not."""
    rng = np.random.default_rng(10)
    angle, e = _swing(4000), rng.standard_normal(4000)
    step = np.diff(angle, prepend=0.0)
    if kind == "glitches":
        e += np.where(rng.random(4000) < 0.02, 15 * rng.standard_normal(4000), 0)
    elif kind == "jitter":
        e += step * 0.4 * rng.standard_normal(4000)
    elif kind == "late":
        e -= 0.7 * step
    elif kind == "coloured":
        e = lfilter([1.0], [1.0, -0.95], 3 * e)
    assert not held_angles([e], [angle], 0.0).present


@pytest.mark.parametrize("samples", [0.5, 1.1, 1.5])
@pytest.mark.parametrize("period", [7, 14])
def test_a_model_that_lags_holds_no_angle(period: int, samples: float) -> None:
    """All the time or now and then, of an axis that swings so quickly that a lag is nothing slow."""
    rng = np.random.default_rng(11)
    time = np.arange(4000)
    angle = 80 * np.sin(2 * np.pi * time / period) * np.sin(2 * np.pi * time / 1700)
    late = np.interp(time - samples, time, angle) - angle
    for when in (np.ones(4000), np.sin(time / 200) > 0):
        assert not held_angles([rng.standard_normal(4000) + when * late], [angle], 0.0).present
    kept = rng.random(4000) < 0.1
    shown = angle[np.maximum.accumulate(np.where(kept, 0, time))] + rng.standard_normal(4000)
    assert held_angles([shown - angle], [angle], 0.0).share == pytest.approx(0.1, rel=0.3)
    assert held_angles([shown - angle], [angle], 0.0).present
