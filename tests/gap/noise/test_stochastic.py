"""Stochastic effects: each recovers its own parameters from simulated residuals, and is quiet on noise."""

from __future__ import annotations

import numpy as np
import pytest
from drive_axis import SIGMA, coloured, white
from fitted import AXIS, SAMPLES, base, of_records, with_residuals

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.noise.stochastic import (
    autoregression,
    held_samples,
    lattice_step,
    outliers,
    quantization,
)

RECORDS = 2


def noise(correlation: float = 0.3) -> list[FloatArray]:
    return [coloured(SAMPLES, SIGMA, correlation, seed) for seed in range(RECORDS)]


def outputs() -> list[FloatArray]:
    found = base()
    return found.simulate(found.builder.axis.nominal)


def test_outliers() -> None:
    """Rate and height within three of their own errors; more likely than one noise."""
    rng, residuals = np.random.default_rng(5), noise()
    for e in residuals:
        e += np.where(rng.random(SAMPLES) < 0.01, rng.normal(0, 30 * SIGMA, SAMPLES), 0)
    fit = with_residuals(residuals)
    found = outliers(fit)
    assert found is not None and found.label == "outliers"
    rate, error, _ = found.parameters["outliers.rate"]
    assert abs(rate - 0.01 * 0.8) < 3 * error + 0.002
    assert found.parameters["outliers.height"][0] == pytest.approx(30 * SIGMA, rel=0.5)
    assert found.log_likelihood > autoregression(fit).log_likelihood + 100
    assert outliers(with_residuals(noise())) is None


@pytest.mark.parametrize("share", [0.15, 0.5])
def test_held_samples(share: float) -> None:
    """The share of repeated samples within three of its errors, where the axis moves."""
    rng, measured, displays = np.random.default_rng(7), [], outputs()
    for e, y in zip(noise(), displays, strict=True):
        source = np.arange(SAMPLES)
        for k in range(1, SAMPLES):
            if rng.random() < share:
                source[k] = source[k - 1]
        measured.append(y[source] + e)
    found = held_samples(of_records(measured, base()))
    assert found is not None and found.form == "held samples" and found.display is not None
    estimate, error, _ = found.parameters["timing_jitter.repeated_share"]
    assert abs(estimate - share) < 3 * max(error, 0.02)
    shown = [found.display.show(y, r) for r, y in enumerate(displays)]
    left = np.concatenate([y - s for y, s in zip(measured, shown, strict=True)])
    assert left.std() < 1.25 * SIGMA
    assert left.std() < 0.8 * np.concatenate([m - y for m, y in zip(measured, displays, strict=True)]).std()


def test_nothing_is_held_in_plain_noise() -> None:
    found = held_samples(with_residuals(noise()))
    assert found is None or found.parameters["timing_jitter.repeated_share"][0] < 0.1


@pytest.mark.parametrize("step", [0.01, 0.02])
def test_quantization(step: float) -> None:
    """The step to 1e-3 and nothing but rounding left; unlike an encoder that does not round."""
    found_base = base()
    sigma = 0.3 * step
    measured = [
        step * np.round((y + white(SAMPLES, sigma, i)) / step)
        for i, y in enumerate(found_base.simulate(found_base.builder.axis.nominal))
    ]
    assert lattice_step(measured) == pytest.approx(step, rel=1e-3)
    found = quantization(of_records(measured, found_base), sigma)
    assert found is not None and found.label == "encoder_quantization" and found.display is not None
    assert found.parameters["encoder_quantization.step"][0] == pytest.approx(step, rel=1e-3)
    plain = [y + white(SAMPLES, SIGMA, i) for i, y in enumerate(outputs())]
    assert lattice_step(plain) == 0
    assert quantization(of_records(plain, found_base), SIGMA) is None


def test_a_lattice_finer_than_the_noise_is_no_quantization() -> None:
    step = 0.5 * SIGMA
    measured = [step * np.round((y + e) / step) for y, e in zip(outputs(), noise(), strict=True)]
    assert quantization(of_records(measured, base()), AXIS.noise_sigma) is None


def test_a_rounded_display_is_the_mean_of_rounded_noise() -> None:
    """The soft staircase against averages over the noise."""
    step, sigma = 0.01, 0.3 * 0.01
    found_base = base(300, 1)
    y = found_base.simulate(found_base.builder.axis.nominal)[0]
    measured = step * np.round((y + white(300, sigma, 1)) / step)
    found = quantization(of_records([measured], found_base), sigma)
    assert found is not None and found.display is not None
    draws = np.random.default_rng(2).normal(0, found.display.sigma, (4000, 1))  # type: ignore[attr-defined]
    expected = np.mean(step * np.round((y + draws) / step), axis=0)
    np.testing.assert_allclose(found.display.show(y, 0), expected, atol=0.05 * step)
