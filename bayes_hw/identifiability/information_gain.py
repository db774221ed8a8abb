"""What an experiment is expected to tell of the parameters, before it is made.

The Laplace approximation of the expected information gain (Lindley, doi 10.1214/aoms/1177728069; Ryan et al.,
doi 10.1111/insr.12107): with the belief's covariance C and the Fisher information F(theta) of the experiment,
in coordinates, the posterior after it has the covariance

    C(theta) = (C^-1 + F(theta))^-1

and the gain about the parameters psi, all others integrated out, is

    U = E_theta [ (log det C_psi - log det C_psi(theta)) / 2 ]     in nats,

the mean over draws theta of the belief. It is exact for a linear model with Gaussian belief and noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.identifiability.sensitivity import fisher_information
from bayes_hw.identify.noise import autoregression_from_partial
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import Parameter, as_coordinates, as_values
from bayes_hw.model.priors import Normal
from bayes_hw.record import Record

LEAST_VARIANCE = 1e-12
"""Added to the belief's correlation matrix, against draws that hardly move."""


@dataclass(frozen=True, eq=False)
class Belief:
    """Draws of what is known before the experiment.

    `axis` is that of the new record alone; `values` (draws, parameters), `covariance` (parameters,
    parameters) of all posterior draws in coordinates; `sigma` (draws,) and `partial` (order, draws) are the
    noise's marginal standard deviation and partial autocorrelations in every draw.
    """

    axis: AxisParameters
    values: FloatArray
    covariance: FloatArray
    sigma: FloatArray
    partial: FloatArray

    @property
    def autoregression(self) -> FloatArray:
        """phi (order, draws)."""
        return autoregression_from_partial(self.partial)

    @property
    def innovation_sigma(self) -> FloatArray:
        """Standard deviation of the noise's innovations (draws,), output units."""
        return np.asarray(self.sigma * np.sqrt(np.prod(1 - self.partial**2, axis=0)))

    @classmethod
    def of(cls, posterior: Posterior, draws: int, rng: np.random.Generator) -> Belief:
        """The belief that a posterior leaves.

        The experiment starts at rest at zero; where the posterior was sampled with free initial conditions,
        its own initial state is unknown under its prior about zero.
        """
        given = posterior.axis
        starts = None if given.start_positions is None else np.zeros(1)
        axis = AxisParameters(
            given.model, given.free, output_scale=given.output_scale, start_positions=starts
        )
        shared = [i for i, name in enumerate(axis.names) if not name.startswith("start")]
        rows = [given.names.index(axis.names[i]) for i in shared]
        n_given = len(given.names)
        flat = posterior.values.reshape(-1, posterior.values.shape[-1])
        parameters = [axis.parameters[i] for i in shared]
        coordinates = as_coordinates(tuple(parameters), flat[:, rows].T)
        covariance = np.diag([_start_variance(parameter) for parameter in axis.parameters])
        covariance[np.ix_(shared, shared)] = np.atleast_2d(np.cov(coordinates))
        chosen = posterior.draws(draws, rng)
        values = np.tile(axis.nominal, (len(chosen), 1))
        values[:, shared] = chosen[:, rows]
        covariance += LEAST_VARIANCE * np.diag(np.diag(covariance))
        return cls(axis, values, covariance, chosen[:, n_given], chosen[:, n_given + 1 :].T)

    def rows(self, names: Sequence[str]) -> list[int]:
        """Places of the parameters `names`; raises InputError naming those there are."""
        known = [name for name in self.axis.names if not name.startswith("start")]
        for name in names:
            if name not in known:
                raise InputError(
                    f"--about {name}: is not a parameter of the axis; choose from {', '.join(known)}"
                )
        return [self.axis.names.index(name) for name in (names or known)]


@dataclass(frozen=True, eq=False)
class ExpectedGain:
    """The gain about the chosen parameters in nats, its standard error over the draws, and the covariances
    (draws, parameters, parameters) in coordinates that the experiment would leave."""

    nats: float
    standard_error: float
    covariances: FloatArray


def expected_gain(belief: Belief, u: FloatArray, about: Sequence[int]) -> ExpectedGain:
    """What the command u (samples,) is expected to tell of the parameters in the rows `about`."""
    model = belief.axis.model
    t = np.arange(len(u)) / model.sample_rate_hz
    record = Record("experiment", t, u, np.zeros(len(u)), model.sample_rate_hz, model.units)
    information = fisher_information(
        belief.axis, belief.values.T, [record], belief.autoregression, belief.innovation_sigma
    )
    return laplace_gain(belief.covariance, np.nan_to_num(information), about)


def laplace_gain(covariance: FloatArray, information: FloatArray, about: Sequence[int]) -> ExpectedGain:
    """The gain from the information (draws, parameters, parameters) for a belief of that covariance."""
    left = updated_covariances(covariance, information)
    chosen = np.ix_(about, about)
    before = np.linalg.slogdet(covariance[chosen])[1]
    after = np.linalg.slogdet(np.stack([each[chosen] for each in left]))[1]
    gains = 0.5 * (before - after)
    error = float(np.std(gains, ddof=1) / np.sqrt(len(gains))) if len(gains) > 1 else float("nan")
    return ExpectedGain(float(np.mean(gains)), error, left)


def updated_covariances(covariance: FloatArray, information: FloatArray) -> FloatArray:
    """(C^-1 + F)^-1 for every F of shape (draws, parameters, parameters), without inverting C."""
    factor = np.linalg.cholesky(covariance)
    inner = np.eye(len(covariance)) + factor.T @ information @ factor
    return np.asarray(factor @ np.linalg.inv(inner) @ factor.T)


def predicted_widths(belief: Belief, covariances: FloatArray) -> FloatArray:
    """Widths (draws, parameters) in values of the 94 % intervals, central in coordinates, that an experiment
    would leave if each draw of the belief were the truth."""
    reach = float(special.ndtri(0.5 + INTERVAL_PROBABILITY / 2))
    parameters = belief.axis.parameters
    centre = as_coordinates(parameters, belief.values.T)
    sd = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2)).T
    low, high = (as_values(parameters, centre + side * reach * sd) for side in (-1, 1))
    return np.abs(high - low).T


def _start_variance(parameter: Parameter) -> float:
    """Prior variance of an initial state; zero for what the posterior knows."""
    return parameter.prior.sd**2 if isinstance(parameter.prior, Normal) else 0.0
