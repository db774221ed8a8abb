"""Samples that were not measured, under every noise of the staged diagnosis: dense Gaussians without them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import linalg, stats

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.noise.clock_jitter import JitterWhitener
from bayes_hw.gap.noise.noise_kernel import jitter_filter
from bayes_hw.gap.noise.state_noise import View, walking_noise
from bayes_hw.gap.noise.whitener import (
    Autoregression,
    Plain,
    fit_autoregression,
    no_glitches,
    only_read,
    readings_of,
)

SAMPLES = 80
CORRELATION, INNOVATION = 0.7, 0.3


def residuals(seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    e = INNOVATION * rng.standard_normal(SAMPLES)
    e[0] /= np.sqrt(1 - CORRELATION**2)
    for k in range(1, SAMPLES):
        e[k] += CORRELATION * e[k - 1]
    return e


def unread(seed: int) -> BoolArray:
    mask = np.random.default_rng(seed).random(SAMPLES) < 0.15
    mask[[0, 40, 41, 42, SAMPLES - 1]] = True
    return mask


def dense(correlation: float, innovation: float) -> FloatArray:
    return linalg.toeplitz(innovation**2 / (1 - correlation**2) * correlation ** np.arange(SAMPLES))


@pytest.mark.parametrize("fill", [0.0, 1e6])
def test_autoregression_conditions_across(fill: float) -> None:
    """Two records of first order: squares of the whitened residual and log-likelihood are the dense ones of
    what was measured, whatever stands in the holes; derivatives are whitened with the same operator."""
    records, masks = [residuals(1), residuals(2)], [unread(1), unread(2)]
    filled = [np.where(mask, fill, e) for e, mask in zip(records, masks, strict=True)]
    noise = fit_autoregression(filled, no_glitches(records), 1, masks)
    sigma = noise.innovation_sigma / np.sqrt(1 - noise.coefficients[0] ** 2)
    noise = replace(noise, sigma=sigma)
    expected = 0.0
    for number, (e, mask) in enumerate(zip(records, masks, strict=True)):
        own = dense(noise.coefficients[0], noise.innovation_sigma)[np.ix_(~mask, ~mask)]
        white = noise.whiten(np.stack([filled[number], 2 * filled[number] + 1], axis=1), number)
        assert np.all(white[mask] == 0)
        for column, y in zip(white.T, (e[~mask], 2 * e[~mask] + 1), strict=True):
            assert column @ column == pytest.approx(y @ np.linalg.solve(own, y), rel=1e-9)
        expected += stats.multivariate_normal(np.zeros(np.sum(~mask)), own).logpdf(e[~mask])
    assert noise.coefficients[0] == pytest.approx(CORRELATION, abs=0.2)
    # The first samples are counted at the innovations' scale, as where nothing is missing.
    assert noise.log_likelihood == pytest.approx(expected, abs=1.0)
    complete = fit_autoregression(records, no_glitches(records), 1, [np.zeros_like(m) for m in masks])
    assert complete.log_likelihood == fit_autoregression(records, no_glitches(records), 1).log_likelihood


def test_plain_noise_does_not_count_them() -> None:
    mask = unread(3)
    white = Plain(2.0, masked=(mask,)).whiten(np.full((SAMPLES, 1), 1e6), 0)
    assert np.all(white[mask] == 0) and np.all(white[~mask] == 5e5)
    assert readings_of([residuals(1)], [mask]) == np.sum(~mask)
    assert len(only_read([residuals(1)], [mask])[0]) == np.sum(~mask)


def test_untimely_and_walking_noise_run_on() -> None:
    """Both Kalman filters, with a variance of infinity where there is no reading."""
    e, mask = residuals(4), unread(4)
    filled = np.where(mask, 1e6, e)
    extra = np.linspace(0.01, 0.2, SAMPLES)
    own = (dense(CORRELATION, INNOVATION) + np.diag(extra))[np.ix_(~mask, ~mask)]
    extra = np.where(mask, np.inf, extra)
    white = np.empty((SAMPLES, 1))
    log_determinant = jitter_filter(filled[:, None], CORRELATION, INNOVATION**2, extra, white)
    assert log_determinant == pytest.approx(np.linalg.slogdet(own)[1], rel=1e-9)
    assert np.sum(white**2) == pytest.approx(e[~mask] @ np.linalg.solve(own, e[~mask]), rel=1e-9)
    jittery = JitterWhitener(CORRELATION, INNOVATION**2, (extra,), 0.0)
    np.testing.assert_array_equal(jittery.whiten(filled[:, None], 0), white)
    walk = walking_noise(0.3, CORRELATION, 0.05)
    view = View(np.ones(SAMPLES), np.where(mask, np.inf, 0.0))
    found = [
        replace(walk, views=(view,)).fitted_to([np.where(mask, x, e)]).log_likelihood for x in (0.0, 1e6)
    ]
    assert found[0] == pytest.approx(found[1], rel=1e-12)
    assert np.isfinite(found[0])


def test_glitches_beside_holes_do_not_count_either() -> None:
    e, mask = residuals(5), unread(5)
    glitches = np.zeros(SAMPLES, dtype=np.bool_)
    glitches[[10, 39, 60]] = True
    spoilt = np.where(glitches, 50.0, np.where(mask, 1e6, e))
    noise = Autoregression(np.array([CORRELATION]), INNOVATION, 0.42, 0.0, [glitches], unread=[mask])
    white = noise.whiten(spoilt[:, None], 0)[:, 0]
    assert np.all(white[mask | glitches] == 0) and np.abs(white).max() < 6
