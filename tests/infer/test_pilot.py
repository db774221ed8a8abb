"""The pilot judges proposals as a chain would, and looks again where walkers sit in what it overlooked."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
from targets import Banana, Gaussian, TwoModes

from bayes_hw.infer.laplace import Laplace
from bayes_hw.infer.pilot import ENOUGH, run_pilot
from bayes_hw.infer.sampler import SamplerSettings, sample
from bayes_hw.progress import Progress


def test_a_laplace_approximation_far_too_narrow_is_widened_step_by_step() -> None:
    """A correlated Gaussian in 16 dimensions, its covariance given 9 times too small and its mean two of
    those widths off: independence proposals are accepted mostly, with no exploring pilot."""
    target, rngs = Gaussian(16), [np.random.default_rng(seed) for seed in (21, 22)]
    narrow = target.covariance / 9
    off = target.mean + 2 * np.sqrt(np.diag(narrow))
    with ThreadPoolExecutor(1) as pool:
        plan, _ = run_pilot(
            [Laplace([(off, narrow)], [target, target])],
            128,
            np.random.default_rng(20),
            rngs,
            pool,
            Progress(quiet=True),
        )
    assert plan.expected_acceptance > 0.7


def test_a_bent_proposal_follows_a_gentle_banana() -> None:
    """From the Laplace approximation at its bend: most proposals are accepted, with no exploring pilot."""

    class Gentle(Banana):
        def log_density(self, x: np.ndarray) -> np.ndarray:
            return -0.5 * x[:, 0] ** 2 - 0.5 * ((x[:, 1] - 0.4 * x[:, 0] ** 2) / 0.5) ** 2

    rng = np.random.default_rng(3)
    choices = [Laplace([(np.zeros(2), np.diag([1.0, 0.25]))], [Gentle()])]
    with ThreadPoolExecutor(1) as pool:
        plan, _ = run_pilot(choices, 64, rng, [rng], pool, Progress(quiet=True))
    assert plan.proposal.bend is not None and plan.expected_acceptance > 0.55


def test_walkers_in_an_overlooked_mode_start_the_exploring_pilot() -> None:
    """The Laplace approximation of one mode is accepted well there, but walkers sit in another."""
    rng = np.random.default_rng(4)
    with ThreadPoolExecutor(1) as pool:
        choices = [Laplace([(np.array([3.0, 0, 0, 0]), np.eye(4))], [TwoModes()])]
        plan, _ = run_pilot(choices, 256, rng, [rng], pool, Progress(quiet=True))
    assert plan.expected_acceptance > ENOUGH
    both = plan.proposal.log_density(np.array([[3.0, 0, 0, 0], [-3.0, 0, 0, 0]]))
    assert abs(both[0] - both[1]) < 3


def test_given_modes_far_apart_get_their_weights() -> None:
    """Modes 40 widths apart, no walker crosses between them but by independence proposals."""

    class Far(TwoModes):
        def log_density(self, x: np.ndarray) -> np.ndarray:
            left, right = np.log(0.3) - 0.5 * (x[:, 0] + 20) ** 2, np.log(0.7) - 0.5 * (x[:, 0] - 20) ** 2
            return np.logaddexp(left, right) - 0.5 * np.sum(x[:, 1:] ** 2, axis=1)

    first, second = np.array([20.0, 0, 0, 0]), np.array([-20.0, 0, 0, 0])
    settings = SamplerSettings(walkers=128, target_ess=4000)
    found = sample(
        Far, first, np.eye(4), np.random.default_rng(5), settings=settings, others=[(second, 2 * np.eye(4))]
    )
    assert found.convergence.converged
    left = found.chain[..., 0] < 0
    error = np.sqrt(0.21 / found.convergence.ess_bulk[0])
    assert abs(left.mean() - 0.3) < 4 * error
