"""Describing functions against the Fourier integrals that define them."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.control.describing_functions import (
    balancing_bias,
    dead_zone_gain,
    saturation_gain,
    saturation_mean,
)

ANGLE = (np.arange(200_000) + 0.5) * 2 * np.pi / 200_000
AMPLITUDE = np.array([0.1, 0.4, 0.9, 3.0, 40.0])


def first_harmonic(output: np.ndarray) -> float:
    return float(2 * np.mean(output * np.sin(ANGLE)))


@pytest.mark.parametrize("bias", [-0.5, 0.0, 0.3, 2.0])
def test_saturation(bias: float) -> None:
    for amplitude in AMPLITUDE:
        output = np.clip(bias + amplitude * np.sin(ANGLE), -0.3, 0.5)
        gain = saturation_gain(np.array(amplitude), np.array(-0.3), np.array(0.5), bias)
        mean = saturation_mean(np.array(amplitude), np.array(-0.3), np.array(0.5), bias)
        assert gain == pytest.approx(first_harmonic(output) / amplitude, abs=1e-6)
        assert mean == pytest.approx(np.mean(output), abs=1e-6)


def test_balancing_bias_leaves_no_mean() -> None:
    """Also with limits as unequal as 1 to 3, for any amplitude; none is needed below both limits."""
    lower, upper = np.array(-0.2), np.array(0.6)
    bias = balancing_bias(AMPLITUDE, lower, upper)
    np.testing.assert_allclose(saturation_mean(AMPLITUDE, lower, upper, bias), 0, atol=1e-9)
    assert bias[0] == pytest.approx(0, abs=1e-9)
    assert bias[-1] < -0.1


def test_dead_zone() -> None:
    for amplitude in AMPLITUDE:
        w = amplitude * np.sin(ANGLE)
        output = np.maximum(w - 0.35, 0) + np.minimum(w + 0.35, 0)
        gain = dead_zone_gain(np.array(amplitude), np.array(0.35))
        assert gain == pytest.approx(first_harmonic(output) / amplitude, abs=1e-6)
    assert dead_zone_gain(np.array(0.0), np.array(0.1)) == 0
    assert dead_zone_gain(np.array(0.2), np.array(0.0)) == 1
