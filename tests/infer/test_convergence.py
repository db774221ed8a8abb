"""Effective sample sizes are those of chains of known autocorrelation, and a bad chain is called one."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from arviz_stats.base import array_stats
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.convergence import (
    ESS_LIMIT,
    R_HAT_LIMIT,
    assess,
    autocorrelation_function,
    autocorrelation_time,
    effective_sample_size,
    nested_r_hat,
    r_hat_of_draws,
)


def autoregressive_chains(tau: float, shape: tuple[int, ...], seed: int) -> FloatArray:
    """Stationary AR(1) chains along axis 1 of `shape` with integrated autocorrelation time `tau`."""
    rng = np.random.default_rng(seed)
    phi = (tau - 1) / (tau + 1)
    shocks = rng.standard_normal(shape)
    shocks[:, 1:] *= np.sqrt(1 - phi**2)
    return np.asarray(signal.lfilter([1.0], [1.0, -phi], shocks, axis=1))


@pytest.mark.parametrize("tau", [0.5, 1.0, 3.0, 19.0, pytest.param(199.0, marks=pytest.mark.slow)])
def test_autocorrelation_time_of_known_chains(tau: float) -> None:
    """Antithetic to very slow AR(1) chains, 10 %."""
    chain = autoregressive_chains(tau, (1, max(1000, round(100 * tau)), 200), seed=1)[0]
    assert autocorrelation_time(chain) == pytest.approx(tau, rel=0.1)


@pytest.mark.parametrize("tau", [1.0, 3.0, 19.0])
def test_effective_sample_size_agrees_with_arviz(tau: float) -> None:
    chains = autoregressive_chains(tau, (4, 2000, 8), seed=2)
    found = effective_sample_size(chains)
    as_arviz = np.moveaxis(chains, 2, 1).reshape(32, 2000)
    assert found == pytest.approx(chains.size / tau, rel=0.1)
    assert found == pytest.approx(float(array_stats.ess(as_arviz, method="bulk")), rel=0.1)


def test_r_hat_of_independent_draws_is_a_number() -> None:
    """About one where they are of one distribution, beyond where they wander; one where there is one."""
    rng = np.random.default_rng(4)
    assert r_hat_of_draws(rng.standard_normal(402)) == pytest.approx(1, abs=0.02)
    assert r_hat_of_draws(np.cumsum(rng.standard_normal(400))) > 1.1
    assert r_hat_of_draws(np.array([0.3])) == 1


def test_autocorrelation_function_of_a_known_chain() -> None:
    """rho(k) = phi^k, unbiased even where the chain is not much longer than the lag."""
    chain = autoregressive_chains(9.0, (1, 60, 4000), seed=3)[0]
    np.testing.assert_allclose(autocorrelation_function(chain)[:40], 0.8 ** np.arange(40), atol=0.01)


def test_independent_ensembles_agree_and_shifted_ones_do_not() -> None:
    """R-hat stays below the limit for the same distribution and rises above it for a third of a shift."""
    chains = np.random.default_rng(4).standard_normal((4, 200, 32))
    assert nested_r_hat(chains) < 1.002
    shifted = chains.copy()
    shifted[2] += 0.35
    assert nested_r_hat(shifted) > R_HAT_LIMIT
    wider = chains.copy()
    wider[1] *= 3
    assert nested_r_hat(wider) > R_HAT_LIMIT


def test_walkers_of_one_ensemble_may_differ_while_ensembles_agree() -> None:
    """Slow walkers that together cover the distribution are not between-ensemble disagreement."""
    rng = np.random.default_rng(5)
    slow = rng.standard_normal((4, 1, 2000)) + 0.01 * rng.standard_normal((4, 50, 2000))
    assert nested_r_hat(slow) < 1.02
    assert autocorrelation_time(slow[0]) > 25


def test_good_chains_converge() -> None:
    chain = np.random.default_rng(6).standard_normal((4, 100, 64, 2))
    verdict = assess(chain, ("a", "b"), np.full(4, 0.5))
    assert verdict.converged and verdict.problems == ()
    assert verdict.ess_bulk.min() == pytest.approx(chain[..., 0].size, rel=0.1)
    assert verdict.ess_tail.min() > ESS_LIMIT
    np.testing.assert_allclose(verdict.autocorrelation_time, 1.0, atol=0.15)


def test_problems_name_the_worst_parameter() -> None:
    chain = np.random.default_rng(7).standard_normal((4, 100, 64, 3))
    chain[0, ..., 1] += 0.5
    chain[0, ..., 2] += 1.0
    verdict = assess(chain, ("fine", "bad", "worst"), np.full(4, 0.5))
    assert not verdict.converged
    assert any("R-hat" in text and "worst" in text and "2 of 3" in text for text in verdict.problems)


def test_too_short_a_chain_is_not_believed() -> None:
    chain = autoregressive_chains(40.0, (4, 100, 512), seed=8)[..., None]
    verdict = assess(chain, ("slow",), np.full(4, 0.3))
    assert any("100 steps are fewer than 5 autocorrelation times" in text for text in verdict.problems)


def test_too_few_effective_samples_are_a_problem() -> None:
    chain = np.random.default_rng(9).standard_normal((4, 50, 1, 1))
    verdict = assess(chain, ("a",), np.full(4, 0.5))
    assert any("bulk effective sample size" in text for text in verdict.problems)
    assert any("tail effective sample size" in text for text in verdict.problems)


def test_a_stuck_ensemble_is_named() -> None:
    rng = np.random.default_rng(10)
    chain = rng.standard_normal((4, 100, 64, 2))
    chain[2] = rng.standard_normal((1, 64, 2))
    verdict = assess(chain, ("a", "b"), np.array([0.4, 0.4, 0.001, 0.4]))
    assert any(text.startswith("ensemble 3 is stuck: it accepts") for text in verdict.problems)
    away = rng.standard_normal((4, 100, 64, 2))
    away[1, ..., 0] += 9
    verdict = assess(away, ("a", "b"), np.full(4, 0.4))
    assert any("ensemble 2 is stuck: its mean lies" in text for text in verdict.problems)
    assert not any("ensemble 1" in text or "ensemble 3" in text for text in verdict.problems)


def test_a_constant_parameter_never_converges() -> None:
    """No division by zero, no warning: infinite R-hat, no effective samples, and not converged."""
    chain = np.random.default_rng(11).standard_normal((4, 60, 16, 2))
    chain[..., 1] = 3.0
    verdict = assess(chain, ("moving", "constant"), np.full(4, 0.5))
    assert not verdict.converged
    assert verdict.r_hat[1] == np.inf and verdict.ess_bulk[1] == 0
    assert any("constant" in text for text in verdict.problems)


def test_one_constant_ensemble_does_not_hide_behind_the_others() -> None:
    chain = np.random.default_rng(12).standard_normal((4, 100, 64, 1))
    chain[3] = 0.0
    verdict = assess(chain, ("a",), np.array([0.5, 0.5, 0.5, 0.0]))
    assert not verdict.converged
    assert any("ensemble 4 is stuck" in text for text in verdict.problems)


def test_parameters_looked_at_side_by_side_are_judged_the_same() -> None:
    chain = np.random.default_rng(8).standard_normal((4, 120, 16, 3))
    alone = assess(chain, ("a", "b", "c"), np.full(4, 0.5))
    with ThreadPoolExecutor(2) as pool:
        beside = assess(chain, ("a", "b", "c"), np.full(4, 0.5), pool)
    assert beside.problems == alone.problems
    for name in ("r_hat", "ess_bulk", "ess_tail", "autocorrelation_time"):
        np.testing.assert_array_equal(getattr(beside, name), getattr(alone, name))
