"""The AR likelihood is the multivariate normal one, and its estimates find what made the noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import linalg, signal, stats

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import (
    MAX_ORDER,
    NoiseEstimate,
    autoregression_from_partial,
    burg,
    estimate_noise,
)
from bayes_hw.infer.noise import LARGEST_ROUNDING, log_likelihood, noise_parameters
from bayes_hw.model.kernel import LaggedSums

REFERENCE_CONDITION = 1e7
"""Beyond it the reference's own inverse has lost the digits that are compared."""
partials = st.lists(st.floats(-0.95, 0.95), min_size=0, max_size=6)


def sums_of(residuals: FloatArray, order: int) -> LaggedSums:
    """What the kernel gives of residuals (walkers, samples)."""
    samples = residuals.shape[1]
    lagged = [np.sum(residuals[:, lag:] * residuals[:, : samples - lag], axis=1) for lag in range(order + 1)]
    return LaggedSums(np.stack(lagged), residuals[:, :order].T, residuals[:, samples - order :].T)


def autocovariance(phi: FloatArray, innovation_sigma: float, lags: int) -> FloatArray:
    """Autocovariances 0 ... lags - 1 by solving the Yule-Walker equations, then by their recursion."""
    order = len(phi)
    system = np.eye(order + 1)
    for k in range(order + 1):
        for i, coefficient in enumerate(phi, start=1):
            system[k, abs(k - i)] -= coefficient
    covariance = linalg.solve(system, np.eye(order + 1)[0] * innovation_sigma**2).tolist()
    while len(covariance) < lags:
        covariance.append(sum(c * covariance[-i] for i, c in enumerate(phi, start=1)))
    return np.array(covariance[:lags])


def innovation_sigma(sigma: float, partial: FloatArray) -> float:
    return sigma * float(np.sqrt(np.prod(1 - partial**2)))


def simulated_ar(phi: FloatArray, samples: int, rng: np.random.Generator) -> FloatArray:
    shocks = rng.standard_normal(samples + 500)
    return np.asarray(signal.lfilter([1.0], np.r_[1.0, -phi], shocks))[500:]


def by_innovations(residuals: FloatArray, sigma: float, partial: FloatArray) -> float:
    """The same from one-step predictions in extended precision, without differences of large sums."""
    e, kappa = residuals.astype(np.longdouble), partial.astype(np.longdouble)
    total, phi = np.longdouble(0), e[:0]
    for k, value in enumerate(e):
        if 0 < k <= len(kappa):
            phi = np.append(phi - kappa[k - 1] * phi[::-1], kappa[k - 1])
        variance = np.longdouble(sigma) ** 2 * np.prod(1 - kappa[: len(phi)] ** 2)
        error = value - phi @ e[k - len(phi) : k][::-1]
        total -= 0.5 * (np.log(2 * np.pi * variance) + error**2 / variance)
    return float(total)


@settings(max_examples=60, deadline=None)
@given(log_size=st.floats(-2, 40), sharpness=st.floats(0.5, 12), order=st.integers(6, 12))
def test_a_likelihood_lost_to_rounding_is_none(log_size: float, sharpness: float, order: int) -> None:
    """Residuals as large as 1e40 under autoregressions with many roots near one: the sums alone once gave
    log-likelihoods of +1e107 there. What is given is right to LARGEST_ROUNDING."""
    residuals = 10**log_size * (1 + np.cos(np.linspace(0, 3, 150))) + np.sin(np.arange(150.0) ** 2)
    partial = np.tanh(sharpness * np.cos(np.arange(order)))
    assume(np.prod(1 - partial**2) > 1e-30)
    (found,) = log_likelihood(sums_of(residuals[None], order), 150, np.ones(1), partial[:, None])
    exact = by_innovations(residuals, 1.0, partial)
    if np.isfinite(found):
        assert found == pytest.approx(exact, rel=1e-6, abs=LARGEST_ROUNDING)
    else:
        assert found == -np.inf and exact < -1e6


@settings(max_examples=60, deadline=None)
@given(partial=partials, seed=st.integers(0, 2**32 - 1), extra=st.integers(1, 30))
def test_likelihood_is_that_of_the_toeplitz_covariance(partial: list[float], seed: int, extra: int) -> None:
    """Orders 0 to 6, records from barely longer than the order, against scipy's multivariate normal."""
    rng = np.random.default_rng(seed)
    kappa, sigma, samples = np.array(partial), float(rng.uniform(0.2, 3)), len(partial) + extra
    phi = autoregression_from_partial(kappa[:, None])[:, 0]
    covariance = linalg.toeplitz(autocovariance(phi, innovation_sigma(sigma, kappa), samples))
    np.testing.assert_allclose(covariance[0, 0], sigma**2, rtol=1e-8)
    assume(np.linalg.cond(covariance) < REFERENCE_CONDITION)
    e = rng.normal(size=(1, samples))
    found = log_likelihood(sums_of(e, len(partial)), samples, np.array([sigma]), kappa[:, None])[0]
    expected = stats.multivariate_normal(np.zeros(samples), covariance).logpdf(e[0])
    assert found == pytest.approx(expected, rel=1e-8, abs=1e-8)


def test_likelihood_of_each_walker_is_its_own() -> None:
    rng = np.random.default_rng(4)
    e, sigma, kappa = rng.normal(size=(3, 40)), rng.uniform(0.5, 2, 3), rng.uniform(-0.8, 0.8, (2, 3))
    together = log_likelihood(sums_of(e, 2), 40, sigma, kappa)
    for i in range(3):
        alone = log_likelihood(sums_of(e[[i]], 2), 40, sigma[[i]], kappa[:, [i]])[0]
        assert together[i] == pytest.approx(alone, rel=1e-14)


@settings(max_examples=100, deadline=None)
@given(partial=st.lists(st.floats(-0.99, 0.99), min_size=1, max_size=MAX_ORDER))
def test_every_vector_of_partial_autocorrelations_is_stationary(partial: list[float]) -> None:
    phi = autoregression_from_partial(np.array(partial)[:, None])[:, 0]
    assert np.abs(np.roots(np.r_[1.0, -phi])).max(initial=0.0) < 1


@settings(max_examples=60, deadline=None)
@given(partial=st.lists(st.floats(-0.9, 0.9), min_size=1, max_size=6))
def test_partial_autocorrelations_are_those_of_the_process(partial: list[float]) -> None:
    """kappa_i is the last coefficient of the best linear predictor of order i (Yule-Walker, solved anew)."""
    kappa = np.array(partial)
    phi = autoregression_from_partial(kappa[:, None])[:, 0]
    covariance = autocovariance(phi, 1.0, len(partial) + 1)
    for order in range(1, len(partial) + 1):
        predictor = linalg.solve(linalg.toeplitz(covariance[:order]), covariance[1 : order + 1])
        assert predictor[-1] == pytest.approx(kappa[order - 1], abs=1e-7)


def test_known_second_order_process() -> None:
    """phi_1 = kappa_1 (1 - kappa_2), phi_2 = kappa_2."""
    phi = autoregression_from_partial(np.array([[0.5], [-0.3]]))[:, 0]
    np.testing.assert_allclose(phi, [0.65, -0.3], rtol=1e-15)


def test_burg_finds_a_second_order_process_within_its_standard_error() -> None:
    """40 simulated sets of three segments: mean within 4 standard errors, spread as in theory."""
    rng = np.random.default_rng(6)
    kappa, samples = np.array([0.6, -0.4]), 3 * 400
    phi = autoregression_from_partial(kappa[:, None])[:, 0]
    found = np.empty((40, 2))
    variance = np.empty(40)
    for i in range(40):
        segments = [simulated_ar(phi, 400, rng) for _ in range(3)]
        found[i], variances = burg(segments, 2)
        variance[i] = variances[-1]
    last_sd = np.sqrt((1 - kappa[1] ** 2) / samples)
    error = found.mean(axis=0) - kappa
    assert abs(error[1]) < 4 * last_sd / np.sqrt(40)
    assert abs(error[0]) < 4 * found[:, 0].std() / np.sqrt(40)
    assert found[:, 1].std() == pytest.approx(last_sd, rel=0.4)
    assert variance.mean() == pytest.approx(1.0, abs=4 * np.sqrt(2 / samples / 40))


def test_estimate_reports_marginal_and_innovation_sigma() -> None:
    rng = np.random.default_rng(7)
    kappa = np.array([0.7, 0.2])
    phi = autoregression_from_partial(kappa[:, None])[:, 0]
    marginal = 2.0 / np.sqrt(np.prod(1 - kappa**2))
    estimate = estimate_noise([2.0 * simulated_ar(phi, 20_000, rng)], order=2)
    assert estimate.order == 2
    assert estimate.innovation_sigma == pytest.approx(2.0, rel=0.02)
    assert estimate.sigma == pytest.approx(marginal, rel=0.06)
    np.testing.assert_allclose(estimate.autoregression, phi, atol=0.03)


@pytest.mark.parametrize(("partial", "order"), [([], 0), ([0.5], 1), ([0.8, -0.5], 2), ([0.5, 0.2, -0.3], 3)])
def test_information_criterion_finds_the_order(partial: list[float], order: int) -> None:
    """In at least nine of ten simulated sets of 2,000 samples."""
    rng = np.random.default_rng(9)
    phi = autoregression_from_partial(np.array(partial).reshape(-1, 1))[:, 0]
    chosen = [estimate_noise([simulated_ar(phi, 2000, rng)]).order for _ in range(30)]
    assert np.count_nonzero(np.array(chosen) == order) >= 27


def test_silent_or_short_residuals_have_no_autocorrelation() -> None:
    """A zero residual divides nothing by zero; a segment of one sample has no lag to use."""
    partial, variances = burg([np.zeros(20)], 3)
    assert not partial.any() and not variances.any()
    partial, variances = burg([np.array([2.0])], 3)
    assert not partial.any() and variances.tolist() == [4.0] * 4


def test_parameters_are_centred_on_the_estimate() -> None:
    estimate = NoiseEstimate(0.03, np.array([0.5, -0.2]))
    sigma, first, second = noise_parameters(estimate, "deg")
    assert [sigma.name, first.name] == ["noise.sigma", "noise.partial_autocorrelation1"]
    assert (sigma.unit, first.unit) == ("deg", "")
    assert (sigma.nominal, first.nominal, second.nominal) == (0.03, 0.5, -0.2)
    assert float(sigma.prior.quantile(np.array(0.5))) == pytest.approx(0.03)
    low, high = sigma.prior.quantile(np.array([0.0228, 0.9772]))
    assert high / 0.03 == pytest.approx(0.03 / low, rel=1e-3)
    assert high / 0.03 == pytest.approx(20, rel=0.01)
    assert first.prior.log_density(np.array([0.0]))[0] == pytest.approx(-np.log(2))
