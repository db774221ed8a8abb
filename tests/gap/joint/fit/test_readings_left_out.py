"""Readings that tell nothing count as not measured, whatever they show, and their errors are still known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from joint_axis import CASCADE, STRUCTURE, measured, scale
from scipy.signal import lfilter

from bayes_hw.arrays import BoolArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.noise.reading_faults import MASK
from bayes_hw.gap.joint.residuals.heavy_tails import tails_of
from bayes_hw.gap.joint.residuals.jumps import sum_kurtosis
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import evaluate, triangular_factor
from bayes_hw.record import Record

SAMPLES, SIGMA, SHARE = 1500, 0.003, 0.05


def fits(glitch: float = 40 * SIGMA) -> tuple[JointFit, JointFit, list[BoolArray]]:
    """Slow noise with glitches: under weights that leave these out, and as records that lack them."""
    rng, shown, lacking = np.random.default_rng(5), list[Record](), list[Record]()
    far: list[BoolArray] = []
    for plain in measured((), SAMPLES, (1, 2)):
        slow = lfilter([1.0], [1.0, -0.95], SIGMA * rng.standard_normal(SAMPLES))
        off = rng.random(SAMPLES) < SHARE
        y = plain.y + slow + np.where(off, glitch, 0.0)
        shown.append(replace(plain, y=y))
        lacking.append(replace(plain, y=y, measured=~off))
        far.append(off)
    weights = tuple(np.where(off, MASK, 1.0) for off in far)
    found = []
    for response in (
        JointResponse(STRUCTURE, (), shown, scale(SAMPLES), weights),
        JointResponse(STRUCTURE, (), lacking, scale(SAMPLES)),
    ):
        coordinates = response.coordinates(JointValues(CASCADE, ()))
        found.append(JointFit(response, evaluate(response, coordinates)))
    return found[0], found[1], far


def test_they_are_holes_of_the_likelihood_and_its_derivatives() -> None:
    weighted, lacking, _ = fits()
    assert weighted.point.samples == lacking.point.samples
    np.testing.assert_allclose(weighted.log_likelihood, lacking.log_likelihood, rtol=1e-12)
    np.testing.assert_allclose(weighted.score, lacking.score, rtol=1e-12)
    np.testing.assert_allclose(np.abs(weighted.factor()), np.abs(lacking.factor()), rtol=1e-7, atol=1e-9)
    own = triangular_factor(weighted.response, weighted.point)
    assert np.isfinite(own).all()
    np.testing.assert_allclose(tails_of(weighted), tails_of(lacking), rtol=1e-9)
    assert sum_kurtosis(weighted, 6) == sum_kurtosis(lacking, 6)


def test_slow_noise_about_them_stays_slow_and_has_no_tails() -> None:
    """Taken for zeros they would make noise of higher order that jumps."""
    weighted, _, _ = fits()
    every = replace(weighted.response, weights=None, records=fits(0.0)[0].response.records)
    clean = weighted.under(every)
    assert weighted.point.whitener.order <= clean.point.whitener.order
    assert abs(weighted.innovation_sigma / clean.innovation_sigma - 1) < 0.05
    assert tails_of(weighted)[0] < 0


def test_their_errors_are_what_the_readings_show() -> None:
    weighted, lacking, far = fits()
    for shown, without, off in zip(weighted.errors, lacking.errors, far, strict=True):
        assert np.isfinite(shown).all()
        np.testing.assert_allclose(shown[~off], without[~off], rtol=1e-12)
        assert abs(np.mean(shown[off]) / (40 * SIGMA) - 1) < 0.2
