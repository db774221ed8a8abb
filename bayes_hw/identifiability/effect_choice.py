"""What an experiment is expected to tell about the choice between two explanations.

Each explanation is a simulator with draws of its parameters. Its predictive density of the record is taken as
Gaussian, with the mean and the covariance of its simulated outputs plus the noise's, so that parameters that
could mimic the other explanation count as they should. The expected information about which of the two is
true is the mutual information (Box and Hill, doi 10.1080/00401706.1967.10490441)

    I(m; y) = H(m) - E_y H(m | y)

by Monte Carlo: records are simulated from draws that the Gaussians have not seen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy import linalg, special

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.output_error import whitened

Simulator: TypeAlias = Callable[[FloatArray, FloatArray], FloatArray]
"""(draws (draws, parameters), command (samples,)) -> noise-free outputs (draws, samples)."""

MOST_PREDICTIVE_DIRECTIONS = 24
"""Directions of the outputs' covariance that are kept, the largest first."""


@dataclass(frozen=True, eq=False)
class Explanation:
    """A simulator with `draws` (draws, parameters) of what it is believed to be, and a name for it."""

    label: str
    simulate: Simulator
    draws: FloatArray


@dataclass(frozen=True)
class ChoiceGain:
    """Expected information about which of two explanations holds, in nats (at most the entropy of the prior),
    its standard error, and the expected probability of the one that is true."""

    nats: float
    standard_error: float
    expected_probability_of_truth: float


class _Predictive:
    """A Gaussian N(mean, I + D D^T) of whitened outputs, D from half the draws of one explanation."""

    def __init__(self, outputs: FloatArray) -> None:
        self.mean = outputs.mean(axis=0)
        centred = (outputs - self.mean) / np.sqrt(max(len(outputs) - 1, 1))
        _, sizes, directions = np.linalg.svd(centred, full_matrices=False)
        kept = min(MOST_PREDICTIVE_DIRECTIONS, len(sizes))
        self.variances, self.directions = sizes[:kept] ** 2, directions[:kept]

    def log_density(self, y: FloatArray) -> FloatArray:
        """Log-density (records,) of whitened records (records, samples), up to a common constant."""
        residual = y - self.mean
        along = residual @ self.directions.T
        saved = np.sum(along**2 * self.variances / (1 + self.variances), axis=1)
        return -0.5 * (np.sum(residual**2, axis=1) - saved + np.sum(np.log1p(self.variances)))


def choice_gain(
    first: Explanation,
    second: Explanation,
    u: FloatArray,
    autoregression: FloatArray,
    innovation_sigma: float,
    rng: np.random.Generator,
    *,
    prior_of_first: float = 0.5,
    noises: int = 4,
) -> ChoiceGain:
    """What the command u (samples,) is expected to tell about which explanation holds.

    The noise is the autoregression (order,) with the given standard deviation of its innovations. One half of
    each explanation's draws gives its predictive density, the other the simulated records, each with
    `noises` noise sequences.
    """
    predictives, records = [], []
    for explanation in (first, second):
        outputs = explanation.simulate(explanation.draws, u)
        rows = whitened(outputs, autoregression) / innovation_sigma
        half = len(rows) // 2
        predictives.append(_Predictive(rows[:half]))
        records.append(np.repeat(rows[half:], noises, axis=0))
    log_prior = np.log([prior_of_first, 1 - prior_of_first])
    entropies, errors, found = [], [], []
    for truth, clean in enumerate(records):
        y = clean + rng.standard_normal(clean.shape)
        log_joint = np.stack([predictive.log_density(y) for predictive in predictives]) + log_prior[:, None]
        log_probability = log_joint - special.logsumexp(log_joint, axis=0)
        probability = np.exp(log_probability)
        entropy = -np.sum(special.xlogy(probability, probability), axis=0)
        entropies.append(float(np.mean(entropy)))
        errors.append(float(np.std(entropy)) / np.sqrt(len(entropy)))
        found.append(float(np.mean(probability[truth])))
    weights = np.exp(log_prior)
    before = -float(np.sum(special.xlogy(weights, weights)))
    return ChoiceGain(
        before - float(weights @ np.array(entropies)),
        float(linalg.norm(weights * np.array(errors))),
        float(weights @ np.array(found)),
    )
