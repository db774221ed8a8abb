"""Wind and a wandering encoder: each recovers its own parameters from simulated residuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import LOAD_TORQUE, RATE, SIGMA, TRAIN, W, coloured, hypothesis, white
from fitted import AXIS, SAMPLES, gusts, shown, with_residuals

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.slow_noise import random_walk, wandering_background, wind
from bayes_hw.gap.noise.stochastic_fit import autoregression
from bayes_hw.model.blocks import DeadZone


def noise(correlation: float = 0.3) -> list[FloatArray]:
    return [coloured(SAMPLES, SIGMA, correlation, seed) for seed in range(2)]


def seen(
    added: list[FloatArray], show: DeadZone = AXIS.dead_zone, motion: list[FloatArray] | None = None
) -> list[FloatArray]:
    """What an encoder behind a dead zone sees of what is added to w, with its noise."""
    return [g + e for g, e in zip(shown(added, show, motion), noise(), strict=True)]


@pytest.mark.parametrize(("corner", "second"), [(0.2, 6.0), (0.2, 0.8)])
def test_wind(corner: float, second: float) -> None:
    """Its standard deviation as the axis shows it to 30 %, both corners to a factor of two."""
    a, b, c = TRAIN.state_space()
    static = float(np.abs((c[[W]] @ np.linalg.solve(2j * np.pi * 1e-3 * np.eye(7) - a, b))[0, LOAD_TORQUE]))
    fit = with_residuals(seen(gusts(corner, second, 3.0)))
    found = wind(fit)
    assert found is not None and found.label == "wind"
    assert found.parameters["wind.sd"][0] == pytest.approx(3.0 * static, rel=0.3)
    assert 1 / 2 < found.parameters["wind.corner_hz"][0] / corner < 2
    if second < 1:
        assert 1 / 2 < found.parameters["wind.second_corner_hz"][0] / second < 2
    assert found.log_likelihood > autoregression(fit).log_likelihood + 20
    assert found.encoder_sigma == pytest.approx(SIGMA, rel=0.25)


def test_wind_that_carries_the_axis_through_a_wide_dead_zone_is_told_from_a_walk() -> None:
    """Of gusts near its edges a part shows, and how large a part depends on the gusts. Where that was taken
    for noise of the encoder, the encoder came out a third too noisy."""
    axis, t = replace(AXIS, dead_zone=DeadZone(0.08)), np.arange(SAMPLES) / RATE
    found = hypothesis(axis, [0.05 * np.sin(0.3 * t), 0.04 * np.sin(0.45 * t + 0.5)])
    motion = found.simulate_signals(found.builder.axis.nominal)
    fit = with_residuals(seen(gusts(0.2, 0.8, 3.0), axis.dead_zone, [w for w, _ in motion]), found)
    gusty, walk = wind(fit), random_walk(fit)
    assert gusty is not None and walk is not None
    assert gusty.log_likelihood > walk.log_likelihood + 200
    assert gusty.encoder_sigma == pytest.approx(SIGMA, rel=0.12)


def test_wind_whitens_wind() -> None:
    """Innovations are white and of unit variance under the fitted wind, not under first-order noise."""
    fit = with_residuals(seen(gusts(0.2, 0.8, 3.0)))
    found = wind(fit)
    assert found is not None
    for whitener, is_white in ((found.whitener, True), (autoregression(fit), False)):
        white_residuals = [whitener.whiten(e[:, None], r)[:, 0] for r, e in enumerate(fit.residuals)]
        lags = [float(np.mean([np.mean(w[k:] * w[:-k]) for w in white_residuals])) for k in (1, 2, 3)]
        bound = 4 / np.sqrt(2 * SAMPLES)
        assert (max(np.abs(lags)) < bound) == is_white
    assert np.std(found.whitener.whiten(fit.residuals[0][:, None], 0)) == pytest.approx(1, abs=0.06)


def test_random_walk() -> None:
    """The size of a step to 30 %, the encoder's own noise beside it."""
    step = 0.1 * SIGMA
    residuals = [e + np.cumsum(white(SAMPLES, step, 10 + i)) for i, e in enumerate(noise())]
    fit = with_residuals(residuals)
    found = random_walk(fit)
    assert found is not None and (found.label, found.form) == ("sensor_drift", "random walk")
    assert found.parameters["sensor_drift.step_sd"][0] == pytest.approx(step, rel=0.3)
    assert found.encoder_sigma == pytest.approx(SIGMA, rel=0.2)
    assert found.log_likelihood > autoregression(fit).log_likelihood + 20


def test_a_background_is_found_where_the_spectrum_gives_no_start() -> None:
    """Two records that wander far: their spectrum is that of a walk alone. Likelier than autoregression."""
    rng = np.random.default_rng(0)
    t = np.arange(300) / 300
    found = [30 * SIGMA * (1 + r) * np.sin(3 * t + r) + SIGMA * rng.normal(size=300) for r in range(2)]
    fit = with_residuals(found)
    assert random_walk(fit).log_likelihood < autoregression(fit).log_likelihood - 100
    background = wandering_background(fit)
    white = np.concatenate([background.whiten(e[:, None], r)[:, 0] for r, e in enumerate(found)])
    assert np.mean(white**2) == pytest.approx(1, abs=0.3)
