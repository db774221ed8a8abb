"""Explanations: one whose fit has run away explains nothing; noise beside chaotic motion is no cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA, white
from fitted import SAMPLES, base, explained, with_residuals
from scipy.signal import lfilter

from bayes_hw.gap.effects.drive import DynamicBacklash, KinematicBacklash
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.effects.friction import CoulombFrictionAtMotor
from bayes_hw.gap.effects.linear import CubicStiffness, UnmodelledMode
from bayes_hw.gap.effects.sensor import GainAsymmetry
from bayes_hw.gap.fit.explanation import (
    REPEATS_MARGIN,
    Explanation,
    repeats_far_ahead,
    with_stochastic,
)
from bayes_hw.gap.fit.hypothesis import LARGEST_STRAIN
from bayes_hw.gap.noise.held_samples import HeldDisplay
from bayes_hw.gap.noise.random_cause import Tracking
from bayes_hw.gap.noise.rounding import RoundedDisplay
from bayes_hw.gap.noise.state_noise import walking_noise
from bayes_hw.gap.noise.stochastic_fit import StochasticFit, autoregression
from bayes_hw.gap.noise.whitener import fit_autoregression, no_glitches


def test_a_fit_that_ran_away_has_no_evidence() -> None:
    """Not a number would stand anywhere in a ranking; minus infinity stands last."""
    fit = with_residuals([white(SAMPLES, SIGMA, 0)])
    noise = autoregression(fit)
    found = StochasticFit("wind", "", noise, noise.log_likelihood, {})
    assert np.isfinite(with_stochastic(found, fit).log_evidence)
    lost = replace(fit, coordinates=np.full_like(fit.coordinates, np.nan))
    assert with_stochastic(found, lost).log_evidence == -np.inf


@pytest.mark.parametrize(
    ("effect", "label", "lost", "labels"),
    [
        (DynamicBacklash(), "wind", True, ("backlash",)),
        (DynamicBacklash(), "sensor_drift", True, ("backlash",)),
        (DynamicBacklash(), "outliers", False, ("backlash", "outliers")),
        (KinematicBacklash(), "wind", False, ("backlash", "wind")),
    ],
)
def test_slow_noise_beside_chaotic_motion_is_motion_that_was_lost(
    effect: Effect, label: str, lost: bool, labels: tuple[str, ...]
) -> None:
    fit = with_residuals([white(SAMPLES, SIGMA, 0), white(SAMPLES, SIGMA, 1)])
    noise = autoregression(fit)
    found = StochasticFit(label, "", noise, noise.log_likelihood, {})
    moved = replace(fit, hypothesis=base().with_effect(effect), coordinates=np.append(fit.coordinates, 0.0))
    explanation = replace(with_stochastic(found, fit), fit=moved)
    assert explanation.chaotic_response == lost
    assert explanation.labels == labels
    assert (explanation.cause_of_noise is None) == lost


def test_the_noise_beside_a_disturbance_keeps_its_own_correlation() -> None:
    """Of slow noise that of the encoder alone counts; one that never forgets is taken for 0.95."""
    fit = with_residuals([white(SAMPLES, SIGMA, 0)])
    for correlation, counted in ((0.7, 0.7), (0.999, 0.95)):
        noise = walking_noise(SIGMA, correlation, 0.1 * SIGMA)
        found = StochasticFit("sensor_drift", "random walk", noise, 0.0, {})
        assert with_stochastic(found, fit).noise_correlation == pytest.approx(counted)
    memory = lfilter([1.0], [1.0, -0.6], white(SAMPLES, SIGMA, 1))
    coloured = with_residuals([memory])
    plain = Explanation(replace(coloured, whitener=autoregression(coloured)), None, 0.0)
    assert plain.noise_correlation == pytest.approx(0.6, abs=0.06)


def test_glitches_beside_motion_that_was_lost_are_a_cause() -> None:
    """Slow noise that stands for chaotic motion names nothing; glitches that it holds are named, alone."""
    fit = with_residuals([white(SAMPLES, SIGMA, 0), white(SAMPLES, SIGMA, 1)])
    noise = autoregression(fit)
    parameters = {"wind.size": (3.0, 0.1, "deg"), "outliers.rate": (0.01, 0.001, "")}
    found = StochasticFit("wind", "with glitches", noise, 0.0, parameters, size=3.0, beside="outliers")
    moved = replace(fit, hypothesis=base().with_effect(DynamicBacklash()))
    explanation = replace(with_stochastic(found, fit), fit=moved)
    assert explanation.chaotic_response
    assert explanation.labels == ("backlash", "outliers")
    assert explanation.name == "backlash (gap in the compliance) + outliers"
    assert explanation.cause_of_noise is not None
    assert list(explanation.cause_of_noise.parameters) == ["outliers.rate"]
    assert replace(explanation, fit=fit).labels == ("outliers", "wind")


@pytest.mark.parametrize(("moved", "strained"), [(0.9, False), (1.1, True), (-1.1, True)])
def test_base_parameters_far_from_the_nominal_strain_an_explanation(moved: float, strained: bool) -> None:
    """Those of the effect may be anywhere."""
    fit = with_residuals([white(SAMPLES, SIGMA, 0)])
    hypothesis = base(records=1).with_effect(KinematicBacklash())
    at = hypothesis.prior_means.copy()
    at[0] += moved * LARGEST_STRAIN * hypothesis.prior_sds[0]
    at[-1] += 2 * LARGEST_STRAIN * hypothesis.prior_sds[-1]
    noise = autoregression(fit)
    found = StochasticFit("outliers", "", noise, noise.log_likelihood, {})
    host = replace(fit, hypothesis=hypothesis, coordinates=at)
    assert replace(with_stochastic(found, fit), fit=host).at_odds_with_prior == strained


@pytest.mark.parametrize(
    ("effect", "number", "moved", "found"),
    [
        (UnmodelledMode(), 2, 0.9, ()),
        (UnmodelledMode(), 2, 1.1, ("unmodelled_mode.damping_ratio",)),
        (UnmodelledMode(), 1, -1.1, ("unmodelled_mode.frequency_hz",)),
        (UnmodelledMode(), 0, 2.0, ()),
        (CoulombFrictionAtMotor(), 1, 2.0, ()),
        (GainAsymmetry(), 0, 2.0, ()),
    ],
)
def test_what_an_effect_never_has_but_its_size_is_unheard_of(
    effect: Effect, number: int, moved: float, found: tuple[str, ...]
) -> None:
    """A mode may be heavy and gains as unequal as they are; what rounds the corner of a friction is nothing
    that anyone knows of."""
    fit = with_residuals([white(SAMPLES, SIGMA, 0)])
    hypothesis = base(records=1).with_effect(effect)
    at = hypothesis.prior_means.copy()
    at[hypothesis.base_count + number] += (
        moved * LARGEST_STRAIN * hypothesis.prior_sds[hypothesis.base_count + number]
    )
    at[0] += 2 * LARGEST_STRAIN * hypothesis.prior_sds[0]
    host = replace(fit, hypothesis=hypothesis, coordinates=at)
    explanation = Explanation(host, None, 0.0)
    assert explanation.unheard_of == found


def shown(label: str, display: HeldDisplay | RoundedDisplay | None, log_evidence: float) -> Explanation:
    fit = with_residuals([white(SAMPLES, SIGMA, 0)])
    noise = autoregression(fit)
    found = StochasticFit(label, "", noise, noise.log_likelihood, {}, display)
    return replace(with_stochastic(found, fit), log_evidence=log_evidence)


def test_repeats_are_far_ahead_of_everything_fresh_or_not_at_all() -> None:
    """Rounding is a fact of its own and counts among what does not repeat."""
    held = shown("timing_jitter", HeldDisplay(()), 0.0)
    rounded = RoundedDisplay(0.1, 0.0, SIGMA)
    for other in (shown("wind", None, 0.0), shown("encoder_quantization", rounded, 0.0)):
        assert not repeats_far_ahead([other, replace(held, log_evidence=REPEATS_MARGIN - 1)])
        assert repeats_far_ahead([other, replace(held, log_evidence=REPEATS_MARGIN + 1)])
        assert not repeats_far_ahead([other])
    assert shown("encoder_quantization", rounded, 0.0).rounded and not held.rounded


@pytest.mark.parametrize(("effect", "label", "gusts"), [
    (CubicStiffness(), "wind", 0.3),
    (CubicStiffness(), "sensor_drift", 0.0),
    (KinematicBacklash(), "wind", 0.0),
])  # fmt: skip
def test_wind_counts_as_bent_where_the_effect_changes_its_path(
    effect: Effect, label: str, gusts: float
) -> None:
    fit = with_residuals([white(SAMPLES, SIGMA, 0), white(SAMPLES, SIGMA, 1)])
    noise = autoregression(fit)
    found = StochasticFit(label, "", noise, noise.log_likelihood, {}, size=0.3)
    moved = replace(fit, hypothesis=base().with_effect(effect), coordinates=np.append(fit.coordinates, 0.0))
    assert replace(with_stochastic(found, fit), fit=moved).bent_disturbance == gusts


def test_encoder_noise_is_what_is_left_beside_every_cause() -> None:
    """First-order noise of its own correlation; beside slow noise that of the encoder alone; white where the
    residuals ask for a higher order, as those of a model that lacks something do."""
    rng = np.random.default_rng(8)
    coloured = lfilter([1.0], [1.0, -0.6], rng.standard_normal(6000))
    fit = with_residuals([coloured])
    alone = replace(explained([coloured]), fit=replace(fit, whitener=autoregression(fit)))
    assert alone.encoder_noise.coefficients == pytest.approx([0.6], abs=0.04)
    assert alone.encoder_noise.sigma == pytest.approx(np.std(coloured), rel=0.05)
    walk = walking_noise(0.5, 0.3, 0.01)
    found = StochasticFit("sensor_drift", "random walk", walk, 0.0, {}, encoder_sigma=0.5, size=2.0)
    beside = with_stochastic(found, fit).encoder_noise
    assert beside.sigma == 0.5 and beside.coefficients == pytest.approx([0.3])
    assert beside.innovation_sigma == pytest.approx(0.5 * np.sqrt(1 - 0.3**2))
    second_order = fit_autoregression(fit.residuals, no_glitches(fit.residuals), 2)
    assert replace(alone, fit=replace(fit, whitener=second_order)).encoder_noise.coefficients == [0.0]


@pytest.mark.parametrize(
    ("label", "alone", "beside"),
    [
        ("wind", Tracking.MEAN_SQUARES, Tracking.MEAN_SQUARES),
        ("timing_jitter", Tracking.MEAN_SQUARES, Tracking.MEAN_SQUARES),
        ("sensor_drift", Tracking.HIDDEN, Tracking.HIDDEN),
        ("encoder_quantization", Tracking.HIDDEN, Tracking.HIDDEN),
        ("outliers", Tracking.HIDDEN, Tracking.EVERY_SAMPLE),
    ],
)
def test_what_a_record_tells_of_the_motion(label: str, alone: Tracking, beside: Tracking) -> None:
    """Wind and timing belong to the motion; drift and rounding are errors of the readings; glitches alone
    leave next to nothing to close, beside a response the readings between them count. A chaotic response is
    told by its mean squares whatever is beside it, and a plain one by every sample."""
    fit = with_residuals([white(SAMPLES, SIGMA, 0)])
    noise = autoregression(fit)
    plain = with_stochastic(StochasticFit(label, "", noise, noise.log_likelihood, {}), fit)
    assert plain.tracking is alone
    hypothesis = fit.hypothesis
    for effect, told in ((KinematicBacklash(), beside), (DynamicBacklash(), Tracking.MEAN_SQUARES)):
        moved = replace(fit, hypothesis=hypothesis.with_effect(effect))
        assert replace(plain, fit=moved).tracking is told
    assert replace(plain, stochastic=None).tracking is Tracking.EVERY_SAMPLE
