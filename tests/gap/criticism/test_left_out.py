"""Densities of left-out blocks are those of the joint normal; the model that holds predicts them best."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis, white
from fitted import AXIS, SAMPLES, explained, noisy, simulated_with, with_residuals
from scipy.stats import multivariate_normal

from bayes_hw.gap.criticism.left_out import block_densities, compare_left_out, stacking_weights
from bayes_hw.gap.effects.catalogue import GainAsymmetry, TransportDelay
from bayes_hw.gap.fit.explanation import Explanation, with_coloured_noise, with_stochastic
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.noise.held_samples import held_samples
from bayes_hw.gap.noise.plain_noise import CorrelatedPlain
from bayes_hw.gap.noise.slow_noise import random_walk
from bayes_hw.gap.noise.whitener import Plain, Whitener

INPUTS = [command(700, 1), command(700, 2)]


def without_parameters(found: Explanation) -> Explanation:
    """The same with an output that depends on no parameter."""
    still = [np.zeros_like(jacobian) for jacobian in found.fit.jacobians]
    return replace(found, fit=replace(found.fit, jacobians=still))


def test_blocks_are_predicted_as_the_joint_normal_of_all_does() -> None:
    """Residuals w somewhere in a linear model: w ~ N(J m, 1 + J P^-1 J'), P the prior's precision and m where
    the prior's mean lies. The conditional density of each block given the rest, by partition."""
    rng = np.random.default_rng(3)
    start = with_residuals([white(60, SIGMA, 0), white(60, SIGMA, 1)])
    count = len(start.coordinates)
    start = replace(start, coordinates=start.coordinates + 0.3 * start.hypothesis.prior_sds)
    tangents = [SIGMA * rng.normal(size=(60, count)) for _ in range(2)]
    found = replace(start, jacobians=tangents, whitener=Plain(SIGMA, log_likelihood=0.0))
    j, w = np.concatenate(tangents) / SIGMA, np.concatenate(found.residuals) / SIGMA
    pull = found.hypothesis.prior_jacobian(found.coordinates)
    prior = pull.T @ pull
    away = -pull.T @ found.hypothesis.prior_deviations(found.coordinates)
    mean, variance = j @ np.linalg.solve(prior, away), np.eye(120) + j @ np.linalg.solve(prior, j.T)
    expected = []
    for rows in np.array_split(np.arange(120), 6):
        rest = np.setdiff1d(np.arange(120), rows)
        gain = np.linalg.solve(variance[np.ix_(rest, rest)], variance[np.ix_(rest, rows)]).T
        at = mean[rows] + gain @ (w[rest] - mean[rest])
        spread = variance[np.ix_(rows, rows)] - gain @ variance[np.ix_(rest, rows)]
        expected.append(multivariate_normal(at, spread).logpdf(w[rows]))
    densities = block_densities(Explanation(found, None, 0.0), blocks=3)
    np.testing.assert_allclose(densities - densities[0], np.array(expected) - expected[0], atol=1e-6)


def walking() -> Explanation:
    walk = [np.cumsum(white(SAMPLES, 0.2 * SIGMA, seed)) for seed in (5, 6)]
    fitted = with_residuals([w + white(SAMPLES, SIGMA, i) for i, w in enumerate(walk)])
    found = random_walk(fitted)
    assert found is not None
    return with_stochastic(found, fitted)


@pytest.mark.parametrize("noise", ["coloured", "walking"])
def test_without_parameters_they_add_up_to_the_likelihood(noise: str) -> None:
    found = (
        explained([white(SAMPLES, SIGMA, 0), white(SAMPLES, SIGMA, 1)]) if noise == "coloured" else walking()
    )
    whitener: Whitener = found.fit.whitener
    assert block_densities(without_parameters(found)).sum() == pytest.approx(
        whitener.log_likelihood, rel=1e-9
    )


def test_a_sample_of_a_wandering_encoder_has_the_scale_of_its_innovation() -> None:
    """The walk starts at zero: early samples are known better, and the densities of the blocks say so."""
    found = without_parameters(walking())
    quiet = replace(found, fit=replace(found.fit, residuals=[0 * e for e in found.fit.residuals]))
    first = block_densities(quiet, blocks=300)[:300]
    assert first[0] > first[50] + 0.05
    assert np.ptp(first[100:]) < 0.01


def test_the_model_that_holds_predicts_best() -> None:
    """A delay of 1.6 samples: far ahead of the base model and of gains that differ, all of the weight."""
    measured = noisy(simulated_with(TransportDelay(), (1.6,), INPUTS))
    plain = Plain(SIGMA)
    found = {}
    for effect in (None, TransportDelay(), GainAsymmetry()):
        h = hypothesis(AXIS, INPUTS, *([effect] if effect else []))
        own = with_coloured_noise(fit(h, measured, h.prior_means, plain), measured)
        found[own.labels] = own
    compared = compare_left_out(found)
    assert set(compared) == {(), ("transport_delay",), ("gain_asymmetry",)}
    best = compared["transport_delay",]
    assert best.density == 0 and best.weight > 0.95
    for labels in ((), ("gain_asymmetry",)):
        assert compared[labels].density < -5 * compared[labels].error < 0


def test_plain_residuals_that_count_for_fewer_are_compared_as_what_they_are() -> None:
    """The fit that holds stays ahead where its noise was counted for half the samples only."""
    measured = noisy(simulated_with(TransportDelay(), (1.6,), INPUTS))
    found = {}
    for effect in (None, TransportDelay()):
        h = hypothesis(AXIS, INPUTS, *([effect] if effect else []))
        own = with_coloured_noise(fit(h, measured, h.prior_means, Plain(SIGMA)), measured)
        found[own.labels] = own
    expected = compare_left_out(found)
    best = found["transport_delay",]
    counted = replace(best, fit=replace(best.fit, whitener=CorrelatedPlain.of(0.3, best.fit)))
    compared = compare_left_out({**found, best.labels: counted})
    assert compared["transport_delay",].density == 0
    assert compared[()].density == pytest.approx(expected[()].density, rel=0.01)


def test_weights_are_those_of_the_best_mixture() -> None:
    """No weights on a grid do better; of models that predict alike neither is left out."""
    densities = np.random.default_rng(2).normal(size=(3, 40)) * 2
    weights = stacking_weights(densities)

    def score(w: np.ndarray) -> float:
        return float(np.mean(np.log(w @ np.exp(densities))))

    grid = [np.array([a, b, 1 - a - b]) for a in np.linspace(0, 1, 41) for b in np.linspace(0, 1 - a, 41)]
    assert score(weights) > max(map(score, grid)) - 1e-9
    assert weights.sum() == pytest.approx(1)
    np.testing.assert_allclose(stacking_weights(np.zeros((2, 9))), 0.5)


def test_an_effect_of_nothing_is_not_ahead_of_the_base() -> None:
    measured = noisy(simulated_with(TransportDelay(), (0.0,), INPUTS))
    found = {}
    for effect in (None, GainAsymmetry()):
        h = hypothesis(AXIS, INPUTS, *([effect] if effect else []))
        own = with_coloured_noise(fit(h, measured, h.prior_means, Plain(SIGMA)), measured)
        found[own.labels] = own
    compared = compare_left_out(found)
    worst = min(compared.values(), key=lambda one: one.density)
    assert worst.density > -3


def test_samples_that_are_shown_twice_are_not_compared() -> None:
    fitted = with_residuals([white(SAMPLES, SIGMA, 0), white(SAMPLES, SIGMA, 1)])
    base = Explanation(replace(fitted, whitener=explained(fitted.residuals).fit.whitener), None, 0.0)
    held = held_samples(fitted)
    if held is None:
        repeated = [np.repeat(y[::2], 2) for y in fitted.measured]
        again = replace(fitted, residuals=[y - s for y, s in zip(repeated, fitted.simulated, strict=True)])
        held = held_samples(again)
    assert held is not None
    shown = with_stochastic(held, fitted)
    assert compare_left_out({(): base, shown.labels: shown}) == {}
