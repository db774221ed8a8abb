"""The pilot judges proposals as a chain would, and looks again where walkers sit in what it overlooked."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from targets import Banana, Gaussian, Target, TwoModes

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.ensemble import EnsembleState, advance, start_ensemble
from bayes_hw.infer.laplace import Laplace
from bayes_hw.infer.moves import weighted_moves
from bayes_hw.infer.pilot import ENOUGH, run_pilot, without_strays
from bayes_hw.infer.sampler import SamplerSettings, sample
from bayes_hw.progress import Progress


@pytest.mark.slow
def test_a_laplace_approximation_far_too_narrow_is_widened_step_by_step() -> None:
    """A correlated Gaussian in 16 dimensions, its covariance given 9 times too small and its mean two of
    those widths off: independence proposals are accepted mostly, with no exploring pilot."""
    target, rngs = Gaussian(16), [np.random.default_rng(seed) for seed in (21, 22)]
    narrow = target.covariance / 9
    off = target.mean + 2 * np.sqrt(np.diag(narrow))
    with ThreadPoolExecutor(1) as pool:
        plan, _ = run_pilot(
            [[Laplace([(off, narrow)], [target, target])]],
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
    choices = [[Laplace([(np.zeros(2), np.diag([1.0, 0.25]))], [Gentle()])]]
    with ThreadPoolExecutor(1) as pool:
        plan, _ = run_pilot(choices, 64, rng, [rng], pool, Progress(quiet=True))
    assert plan.proposal.bend is not None and plan.expected_acceptance > 0.55


@pytest.mark.parametrize(("curvature", "chosen"), [(0.0, 0), (8.0, 1)])
def test_coordinates_that_cost_more_are_for_what_is_bent(curvature: float, chosen: int) -> None:
    """A ridge in eight dimensions, and the same straightened: taken where the ridge is bent."""

    class Ridge(Gaussian):
        def __call__(self, x: np.ndarray) -> np.ndarray:
            bent = x.copy()
            bent[:, 1] -= np.sin(curvature * x[:, 0])
            return np.asarray(super().__call__(bent))

    class Straightened:
        def to_plain(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            plain = points.copy()
            plain[..., 1] += np.sin(curvature * points[..., 0])
            return plain, np.zeros(points.shape[:-1])

        def from_plain(self, plain: np.ndarray) -> np.ndarray:
            points = plain.copy()
            points[..., 1] -= np.sin(curvature * plain[..., 0])
            return points

    target, rng = Ridge(8), np.random.default_rng(6)
    target.mean, target.precision = np.zeros(8), np.diag([1.0, 400.0, *np.ones(6)])
    plain = Laplace([(np.zeros(8), np.linalg.inv(target.precision))], [target])
    choices = [[plain], [replace(plain.carried(Straightened()), choice=1)]]
    with ThreadPoolExecutor(1) as pool:
        plan, _ = run_pilot(choices, 64, rng, [rng], pool, Progress(quiet=True))
    assert plan.choice == chosen


def test_walkers_in_an_overlooked_mode_start_the_exploring_pilot() -> None:
    """The Laplace approximation of one mode is accepted well there, but walkers sit in another."""
    rng = np.random.default_rng(4)
    with ThreadPoolExecutor(1) as pool:
        choices = [[Laplace([(np.array([3.0, 0, 0, 0]), np.eye(4))], [TwoModes()])]]
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


PEAK = np.full(8, 30.0)


class WithPeak(Target):
    """A standard normal density, and a peak of width 1e-4 at PEAK so much higher than its top."""

    def __init__(self, height: float) -> None:
        super().__init__(len(PEAK))
        self.height = height

    def log_density(self, x: FloatArray) -> FloatArray:
        wide = -0.5 * np.sum(x**2, axis=-1)
        return np.logaddexp(wide, self.height - 0.5 * np.sum(((x - PEAK) / 1e-4) ** 2, axis=-1))


def settled(height: float, peaked: Sequence[int]) -> tuple[FloatArray, FloatArray, EnsembleState]:
    density = WithPeak(height)
    start = np.random.default_rng(1).standard_normal((64, 8))
    start[list(peaked)] = PEAK
    proposal = Laplace([(np.zeros(8), np.eye(8))], [density]).proposal(1.0)
    state = start_ensemble(start, density, 3)
    chain, log_density, _, after = advance(state, density, weighted_moves(proposal, 0.5), 20)
    return chain, log_density, after


def test_a_walker_in_a_low_and_narrow_peak_is_put_among_the_others() -> None:
    chain, log_density, state = settled(-40.0, [7])
    assert (state.coordinates[7] == PEAK).all()
    freed = without_strays(chain, log_density, state)
    assert (np.abs(freed.coordinates) < 8).all()
    np.testing.assert_allclose(freed.log_probability, WithPeak(-40.0)(freed.coordinates))
    others = np.delete(np.arange(64), 7)
    np.testing.assert_array_equal(freed.coordinates[others], state.coordinates[others])
    assert freed.random_state is state.random_state


@pytest.mark.parametrize(("height", "peaked"), [(5.0, [7]), (-40.0, []), (-40.0, range(64))])
def test_nothing_else_is_moved(height: float, peaked: Sequence[int]) -> None:
    """Not from a peak higher than all else, nor where nobody is stuck, nor where everybody is."""
    chain, log_density, state = settled(height, peaked)
    same = without_strays(chain, log_density, state)
    np.testing.assert_array_equal(same.coordinates, state.coordinates)
    np.testing.assert_array_equal(same.log_probability, state.log_probability)
