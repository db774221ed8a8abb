"""The criterion prefers the fewest parameters that are enough, and looks away from slow errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.criterion import dynamics_criterion
from bayes_hw.identify.noise import estimate_noise


def autoregressive(correlation: float, samples: int) -> FloatArray:
    white = np.random.default_rng(4).standard_normal(samples)
    return np.asarray(signal.lfilter([1.0], [1.0, -correlation], white))


def test_a_parameter_without_effect_costs_log_n() -> None:
    e = [autoregressive(0.5, 1000)]
    assert dynamics_criterion(e, 3) - dynamics_criterion(e, 2) == pytest.approx(np.log(1000))


def test_a_slow_error_hardly_moves_the_criterion() -> None:
    e = autoregressive(0.0, 4000)
    drifting = e + 3 * np.sin(2 * np.pi * np.arange(4000) / 4000)
    assert dynamics_criterion([drifting], 2) - dynamics_criterion([e], 2) < 1500


def test_noise_has_the_size_and_colour_of_its_process() -> None:
    noise = estimate_noise([autoregressive(0.6, 20_000), autoregressive(0.6, 20_000)])
    assert noise.autoregression == pytest.approx([0.6], abs=0.02)
    assert noise.sigma == pytest.approx(1 / np.sqrt(1 - 0.36), rel=0.03)


def test_white_noise_gets_no_autoregression() -> None:
    assert len(estimate_noise([autoregressive(0.0, 20_000)]).autoregression) == 0
