"""The exact likelihood of repeated and rounded samples: by enumeration, by scipy, and its maximum."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from drive_axis import SIGMA, command, hypothesis, white
from fitted import AXIS, of_records
from scipy.stats import norm

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.fit.draws import posterior_draws
from bayes_hw.gap.fit.exact_maximum import DisplayDensity, at_exact_maximum, exact_likelihood
from bayes_hw.gap.fit.explanation import Explanation, with_stochastic
from bayes_hw.gap.fit.fit import fit
from bayes_hw.gap.noise.display_kernel import held_log_likelihood, rounded_log_likelihood
from bayes_hw.gap.noise.held_samples import held_samples
from bayes_hw.gap.noise.rounding import quantization
from bayes_hw.gap.noise.whitener import Plain

INPUTS = [command(900, 1), command(900, 2)]


def shown(y: FloatArray, repeated: BoolArray) -> FloatArray:
    """Every sample, or the one shown before it where it is a repeat."""
    held = y.copy()
    for k in range(1, len(y)):
        if repeated[k]:
            held[k] = held[k - 1]
    return held


@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_repeats_by_enumeration(correlation: float) -> None:
    """The forward algorithm against the sum over all 2^7 patterns of repeats."""
    rng = np.random.default_rng(1)
    s, y = rng.normal(size=8), rng.normal(size=8)
    hold, sigma = 0.35, 0.8
    total = 0.0
    for pattern in product([False, True], repeat=7):
        e = y - shown(s, np.array([False, *pattern]))
        innovations = np.concatenate([[e[0]], e[1:] - correlation * e[:-1]])
        weight = np.prod([hold if repeat else 1 - hold for repeat in pattern])
        total += weight * np.prod(norm.pdf(innovations, scale=sigma))
    found = np.zeros(1)
    one = np.ones(1)
    held_log_likelihood(y, s[:, None], hold * one, correlation * one, sigma * one, found)
    assert found[0] == pytest.approx(np.log(total) + np.log(1 - hold), rel=1e-9)


def test_rounding_by_the_normal_distribution() -> None:
    """Intervals of the normal distribution near the middle, and its logarithm far out in the tail."""
    rng = np.random.default_rng(2)
    s, step = rng.normal(size=(50, 2)), 0.5
    y = step * np.round((s[:, 0] + 0.1 * rng.normal(size=50)) / step)
    sigma, found = np.array([0.2, 0.4]), np.zeros(2)
    rounded_log_likelihood(y, s, step, sigma, np.zeros(2), found)
    for i in range(2):
        z = (np.abs(y - s[:, i])[:, None] + np.array([-0.5, 0.5]) * step) / sigma[i]
        expected = np.sum(norm.logsf(z[:, 0]) + np.log1p(-np.exp(norm.logsf(z[:, 1]) - norm.logsf(z[:, 0]))))
        assert found[i] == pytest.approx(expected, rel=2e-3)


def explained(kind: str, seed: int) -> tuple[Explanation, FloatArray]:
    """The axis under a display, its parameters first estimated as if there were none; the true ones."""
    rng = np.random.default_rng(seed)
    found = hypothesis(AXIS, INPUTS)
    truth = found.prior_means + 0.3 * found.prior_sds * rng.normal(size=len(found.prior_means))
    records = []
    for y in found.simulate(found.to_values(truth)):
        if kind == "held":
            records.append(shown(y, rng.random(len(y)) < 0.3) + white(len(y), SIGMA, seed))
        else:
            records.append(8 * SIGMA * np.round((y + white(len(y), SIGMA, seed)) / (8 * SIGMA)))
    start = fit(found, records, found.prior_means, Plain(SIGMA))
    stochastic = held_samples(start) if kind == "held" else quantization(start, SIGMA)
    assert stochastic is not None
    return with_stochastic(stochastic, start), truth


@pytest.mark.parametrize("kind", ["held", "rounded"])
def test_the_maximum_is_no_worse_and_stays_there(kind: str) -> None:
    """More likely than where it started; a second search from there gains nothing; noise near the true."""
    begun, _ = explained(kind, 3)
    done = at_exact_maximum(begun)
    again = at_exact_maximum(done)
    assert done.stochastic is not None and again.stochastic is not None
    likelihood = exact_likelihood(begun)
    assert likelihood is not None
    density = DisplayDensity(begun.fit, likelihood)
    at_start = likelihood([y[:, None] for y in begun.fit.simulated], density.centre[density.count :][None])
    assert done.stochastic.log_likelihood > at_start[0]
    assert again.stochastic.log_likelihood == pytest.approx(done.stochastic.log_likelihood, abs=0.5)
    assert done.encoder_sigma == pytest.approx(SIGMA, rel=0.15)


def test_rounding_is_on_the_scale_of_the_search() -> None:
    """At the same outputs and noise the exact likelihood is that of the search: other sets of effects are
    held against those at exact maxima."""
    begun, _ = explained("rounded", 3)
    likelihood = exact_likelihood(begun)
    assert likelihood is not None and begun.stochastic is not None
    exact = likelihood([y[:, None] for y in begun.fit.simulated], likelihood.start[None])
    assert exact[0] == pytest.approx(begun.stochastic.log_likelihood, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["held", "rounded"])
def test_posteriors_under_a_display_cover(kind: str) -> None:
    """Of the eight base parameters in six simulated cases at least 39 of 48 lie in their 94 % intervals."""
    inside = 0
    for seed in range(6):
        begun, truth = explained(kind, 10 + seed)
        drawn = posterior_draws(at_exact_maximum(begun), np.random.default_rng(seed))
        low, high = np.quantile(drawn.coordinates, [0.03, 0.97], axis=0)
        inside += int(np.sum((low <= truth) & (truth <= high)))
        assert drawn.sigma is not None and abs(np.mean(drawn.sigma) / SIGMA - 1) < 0.3
    assert inside >= 39


def test_nothing_to_do_without_a_display() -> None:
    found = hypothesis(AXIS, INPUTS)
    simulated = found.simulate(found.builder.axis.nominal)
    plain = Explanation(of_records(simulated, found), None, 0.0)
    assert at_exact_maximum(plain) is plain and exact_likelihood(plain) is None
