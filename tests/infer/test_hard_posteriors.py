"""Posteriors that are not the twin's: each agrees with a chain that shares nothing with the pilot."""

from __future__ import annotations

import numpy as np
import pytest
from hard_axes import HARD_AXES, HardAxis, hard_axis

from bayes_hw.arrays import FloatArray
from bayes_hw.infer.convergence import autocorrelation_time, effective_sample_size
from bayes_hw.infer.ensemble import advance, start_ensemble
from bayes_hw.infer.inference import Inference, infer
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.moves import DifferentialEvolutionMove
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.axis_parameters import FreeSet
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

SETTINGS = SamplerSettings(max_steps=1000, target_ess=1000)
UNIMODAL = HARD_AXES[:3]


def inferred(name: str, free: FreeSet = "all") -> tuple[HardAxis, Inference]:
    hard = hard_axis(name, np.random.default_rng(1), samples=600)
    return hard, infer(hard.model, [hard.record], np.random.default_rng(2), free=free, settings=SETTINGS)


def differential_evolution(hard: HardAxis, inference: Inference, steps: int) -> FloatArray:
    """A chain (steps, walkers, parameters) of differential evolution alone, from thinned draws after a
    burn-in of as many steps."""
    target = LogPosterior(inference.posterior.axis, inference.posterior.noise_parameters, [hard.record])
    flat = inference.sampling.chain.reshape(-1, target.dimension)
    start = flat[np.random.default_rng(3).choice(len(flat), 256, replace=False)]
    moves = [(DifferentialEvolutionMove(), 0.9), (DifferentialEvolutionMove(1.0), 0.1)]
    _, _, _, state = advance(start_ensemble(start, target, 4), target, moves, steps)
    return advance(state, target, moves, steps)[0]


@pytest.mark.slow
@pytest.mark.parametrize("name", UNIMODAL)
def test_agrees_with_differential_evolution_alone(name: str) -> None:
    """Means and standard deviations of every coordinate within 4.5 Monte Carlo standard errors."""
    hard, inference = inferred(name)
    assert inference.posterior.converged, inference.posterior.problems
    reference = differential_evolution(hard, inference, 250)
    sampling = inference.sampling
    for i in range(reference.shape[-1]):
        found, other = sampling.chain[..., i], reference[..., i]
        size = other.size / autocorrelation_time(other)
        for power in (1, 2):
            a, b = (found - other.mean()) ** power, (other - other.mean()) ** power
            error = np.sqrt(b.var() / size + a.var() / effective_sample_size(a))
            assert abs(a.mean() - b.mean()) < 4.5 * error, (name, i, power)


@pytest.mark.slow
def test_both_modes_of_a_dead_zone_are_found_and_weighed() -> None:
    """Against the evidence of either mode, by quadrature over the dead zone with Laplace's method for the
    rest at every value of it."""
    _, inference = inferred("bimodal dead zone", "conditional")
    assert inference.posterior.converged, inference.posterior.problems
    assert len(inference.start.others) == 1
    delta = inference.posterior.chains("dead_zone.half_width")
    low, high = delta[delta < 0.115], delta[delta > 0.115]
    assert low.mean() == pytest.approx(0.092, abs=0.004) and high.mean() == pytest.approx(0.139, abs=0.004)
    more = SamplerSettings(target_ess=4000)
    again = infer(*_model_and_record(), np.random.default_rng(9), free="conditional", settings=more)
    share = (delta > 0.115).mean()
    other = (again.posterior.chains("dead_zone.half_width") > 0.115).mean()
    error = np.sqrt(0.25 / inference.sampling.convergence.ess_bulk[2])
    assert abs(share - other) < 4 * error and 0.1 < share < 0.97
    assert share == pytest.approx(_share_by_quadrature(inference), abs=0.06)


def _model_and_record() -> tuple[HammersteinWiener, list[Record]]:
    hard = hard_axis("bimodal dead zone", np.random.default_rng(1))
    return hard.model, [hard.record]


def _share_by_quadrature(inference: Inference) -> float:
    """Posterior mass with a dead zone beyond 0.115, by quadrature over dead zone, gain and noise: the limits,
    which no command reaches, factor out."""
    hard = hard_axis("bimodal dead zone", np.random.default_rng(1))
    posterior = inference.posterior
    target = LogPosterior(posterior.axis, posterior.noise_parameters, [hard.record])
    delta = np.linspace(0.08, 0.16, 81)
    gain, sigma, kappa = np.linspace(0.46, 0.56, 41), np.linspace(0.006, 0.016, 15), np.linspace(0.1, 0.9, 15)
    grid = np.stack(np.meshgrid(delta, gain, sigma, kappa, indexing="ij"), axis=-1).reshape(-1, 4)
    values = np.column_stack([np.full((len(grid), 2), [-2.0, 2.0]), grid])
    coordinates = target.coordinates(values)
    log_density = np.concatenate([target(part) for part in np.array_split(coordinates, 64)])
    log_density -= np.log(values[:, 2]) + np.log(values[:, 3]) + np.log(values[:, 4])
    log_density -= np.log(1 - values[:, 5] ** 2)
    mass = np.exp(log_density - log_density.max()).reshape(len(delta), -1).sum(axis=1)
    return float(mass[delta > 0.115].sum() / mass.sum())
