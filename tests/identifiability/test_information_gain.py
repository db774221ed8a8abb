"""Expected information gain against the closed form of a linear Gaussian model, and nested Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import special

from bayes_hw.errors import InputError
from bayes_hw.identifiability.information_gain import (
    Belief,
    expected_gain,
    laplace_gain,
    predicted_widths,
    scaled_inverse,
)
from bayes_hw.identify.output_error import prior_scale
from bayes_hw.infer.inference import infer
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def linear_experiment() -> tuple[np.ndarray, np.ndarray]:
    """A covariance of three parameters and the slopes of eight measurements with unit noise."""
    rng = np.random.default_rng(1)
    factor = rng.standard_normal((3, 3))
    return factor @ factor.T + 0.1 * np.eye(3), rng.standard_normal((8, 3))


@pytest.mark.parametrize("about", [[0, 1, 2], [1], [0, 2]])
def test_linear_gaussian_gain_is_exact(about: list[int]) -> None:
    """Against the mutual information of psi and y from their joint covariance, by determinants."""
    covariance, slopes = linear_experiment()
    found = laplace_gain(covariance, np.linalg.inv(covariance)[None], (slopes.T @ slopes)[None], about)
    cross = covariance[about] @ slopes.T
    output = slopes @ covariance @ slopes.T + np.eye(8)
    psi = covariance[np.ix_(about, about)]
    joint = np.block([[psi, cross], [cross.T, output]])
    logdet = [np.linalg.slogdet(matrix)[1] for matrix in (psi, output, joint)]
    assert found.nats == pytest.approx(0.5 * (logdet[0] + logdet[1] - logdet[2]), rel=1e-10)


def test_linear_gaussian_gain_agrees_with_nested_monte_carlo() -> None:
    """E[log p(y | theta) - log mean_j p(y | theta_j)] with 1,000 outer and 5,000 inner draws."""
    covariance, slopes = linear_experiment()
    slopes = 0.5 * slopes
    rng = np.random.default_rng(2)
    outer = rng.multivariate_normal(np.zeros(3), covariance, 1_000)
    inner = rng.multivariate_normal(np.zeros(3), covariance, 5_000)
    y = outer @ slopes.T + rng.standard_normal((1_000, 8))
    own = -0.5 * np.sum((y - outer @ slopes.T) ** 2, axis=1)
    means = inner @ slopes.T
    squares = np.sum(y**2, axis=1)[:, None] + np.sum(means**2, axis=1) - 2 * y @ means.T
    marginal = special.logsumexp(-0.5 * squares, axis=1) - np.log(len(inner))
    nested, error = np.mean(own - marginal), np.std(own - marginal) / np.sqrt(1_000)
    exact = laplace_gain(covariance, np.linalg.inv(covariance)[None], (slopes.T @ slopes)[None], [0, 1, 2])
    assert exact.nats == pytest.approx(nested, abs=4 * error + 0.02)


def test_badly_scaled_matrices_are_inverted() -> None:
    scale = np.array([1e-6, 1.0, 1e5])
    matrix = np.array([[2.0, 0.3, 0.1], [0.3, 1.0, 0.2], [0.1, 0.2, 3.0]])
    found = scaled_inverse(matrix * np.outer(scale, scale))
    np.testing.assert_allclose(found * np.outer(scale, scale), np.linalg.inv(matrix), rtol=1e-12)


@pytest.fixture(scope="module")
def posterior(small_axis: HammersteinWiener, swinging_record: Record) -> Posterior:
    settings = SamplerSettings(ensembles=2, walkers=32, max_steps=150, target_ess=300)
    return infer(small_axis, [swinging_record], np.random.default_rng(1), settings=settings).posterior


def test_belief_knows_what_the_records_told(posterior: Posterior, swinging_record: Record) -> None:
    """Where the posterior is nearly Gaussian the local precision is the inverse of the draws' covariance."""
    belief = Belief.of(posterior, 8, np.random.default_rng(2), [swinging_record])
    local = np.sqrt(np.diagonal(scaled_inverse(belief.precision), axis1=1, axis2=2))
    np.testing.assert_allclose(local, np.tile(np.sqrt(np.diag(belief.covariance)), (8, 1)), rtol=0.3)
    blind = Belief.of(posterior, 8, np.random.default_rng(2))
    np.testing.assert_allclose(blind.precision[0] @ blind.covariance, np.eye(8), atol=1e-6)
    assert blind.sigma.shape == (8,)


def test_repeating_the_record_halves_the_variance(posterior: Posterior, swinging_record: Record) -> None:
    """The same command again: about half a log 2 nats a parameter, and intervals shorter by root two."""
    belief = Belief.of(posterior, 8, np.random.default_rng(3), [swinging_record])
    gain = expected_gain(belief, swinging_record.u, belief.rows([]))
    assert gain.nats == pytest.approx(8 * 0.5 * np.log(2), abs=0.4)
    widths = np.mean(predicted_widths(belief, gain.covariances), axis=0)
    now = np.array([np.ptp(posterior.summaries[name].hdi94) for name in belief.axis.names])
    np.testing.assert_allclose(widths / now, 1 / np.sqrt(2), rtol=0.2)


def test_a_command_that_does_nothing_tells_nothing(posterior: Posterior, swinging_record: Record) -> None:
    belief = Belief.of(posterior, 4, np.random.default_rng(4), [swinging_record])
    gain = expected_gain(belief, np.zeros(100), belief.rows(["velocity_gain", "saturation.upper"]))
    assert gain.nats == pytest.approx(0.0, abs=0.3)


def test_unknown_parameters_are_named(posterior: Posterior) -> None:
    belief = Belief.of(posterior, 4, np.random.default_rng(5))
    with pytest.raises(InputError, match=r"--about noise\.sigma.*choose from saturation\.lower"):
        belief.rows(["noise.sigma"])


@pytest.mark.slow
def test_a_free_start_adds_its_unknown_state(small_axis: HammersteinWiener, swinging_record: Record) -> None:
    settings = SamplerSettings(ensembles=2, walkers=32, max_steps=50)
    rng = np.random.default_rng(6)
    found = infer(small_axis, [swinging_record], rng, start="free", settings=settings).posterior
    belief = Belief.of(found, 3, rng, [swinging_record])
    starts = [i for i, name in enumerate(belief.axis.names) if name.startswith("start")]
    assert starts
    _, prior_sd = prior_scale(belief.axis)
    np.testing.assert_allclose(np.sqrt(np.diag(belief.covariance))[starts], prior_sd[starts], rtol=1e-2)
    assert expected_gain(belief, swinging_record.u, belief.rows([])).nats > 0
