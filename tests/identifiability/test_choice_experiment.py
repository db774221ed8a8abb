"""A command designed to tell two simulators apart does so better than one made for anything else."""

from __future__ import annotations

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.choice_experiment import design_choice
from bayes_hw.identifiability.effect_choice import Explanation, Simulator, choice_gain
from bayes_hw.identifiability.excitation_families import Circumstances
from bayes_hw.identifiability.motion_limits import MotionLimits
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.infer.inference import infer
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


@pytest.fixture(scope="module")
def posterior(small_axis: HammersteinWiener, swinging_record: Record) -> Posterior:
    settings = SamplerSettings(ensembles=2, walkers=32, max_steps=50)
    return infer(small_axis, [swinging_record], np.random.default_rng(1), settings=settings).posterior


def axis_simulator(posterior: Posterior, *, delay: int) -> Simulator:
    """The believed axis, its command `delay` samples late: a toy effect."""

    def simulate(draws: FloatArray, u: FloatArray) -> FloatArray:
        late = np.concatenate([np.zeros(delay), u])[: len(u)]
        record = Record("toy", np.arange(len(u)) / 20, late, late, 20.0, posterior.axis.model.units)
        return simulated_outputs(posterior.axis, draws.T, [record])[0]

    return simulate


def test_fast_commands_tell_a_delay(posterior: Posterior) -> None:
    """One sample of delay against none, in six seconds of small commands: told by the winner, and hardly by a
    slow swing of the same size."""
    draws = posterior.draws(40, np.random.default_rng(2))[:, : len(posterior.axis.parameters)]
    first = Explanation("none", axis_simulator(posterior, delay=0), draws)
    second = Explanation("delay", axis_simulator(posterior, delay=1), draws)
    limits = MotionLimits(0.08, 5.0, -1.0, 1.0)
    circumstances = Circumstances(20.0, 6.0, limits, posterior.mean_model().saturation)
    found = design_choice(first, second, posterior, circumstances, np.random.default_rng(3), evaluations=24)
    winner, gain = found[0]
    assert len(found) == 5
    assert limits.allow(winner.u, 20.0)
    assert [entry[1].nats for entry in found] == sorted((entry[1].nats for entry in found), reverse=True)
    slow = 0.08 * np.sin(2 * np.pi * 0.1 * np.arange(120) / 20)
    sigma = float(posterior.summaries["noise.sigma"].mean)
    tame = choice_gain(first, second, slow, np.zeros(0), sigma, np.random.default_rng(4))
    assert gain.nats > tame.nats + 0.1
    assert gain.expected_probability_of_truth > 0.8
