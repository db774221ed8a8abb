"""What an experiment is expected to tell of the parameters, before it is made.

The Laplace approximation of the expected information gain (Lindley, doi 10.1214/aoms/1177728069; Ryan et al.,
doi 10.1111/insr.12107). If theta is the truth, the earlier records know it with the precision P(theta), the
prior's plus their Fisher information there, the experiment adds its own Fisher information F(theta), all in
coordinates, and the posterior then has the covariance

    C(theta) = (P(theta) + F(theta))^-1

The gain about the parameters psi, all others integrated out, is

    U = (log det C_psi - E_theta log det C_psi(theta)) / 2     in nats,

with C the covariance of the belief's draws and the mean over them. It is exact for a linear model with
Gaussian belief and noise, where P = C^-1.
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
from bayes_hw.identify.output_error import prior_scale
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import Parameter, as_coordinates, as_values
from bayes_hw.record import Record

LEAST_VARIANCE = 1e-12
"""Added to the belief's correlation matrix, against draws that hardly move."""


@dataclass(frozen=True, eq=False)
class Belief:
    """Draws of what is known before the experiment.

    `axis` is that of the new record alone; `values` (draws, parameters); `covariance` (parameters,
    parameters) that of all posterior draws in coordinates, and `precision` (draws, parameters, parameters)
    what the earlier records and the prior know near each draw; `sigma` (draws,) and `partial` (order, draws)
    are the noise's marginal standard deviation and partial autocorrelations in every draw.
    """

    axis: AxisParameters
    values: FloatArray
    covariance: FloatArray
    precision: FloatArray
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
    def of(
        cls, posterior: Posterior, draws: int, rng: np.random.Generator, records: Sequence[Record] = ()
    ) -> Belief:
        """The belief that a posterior leaves; `records` are those it was sampled with.

        Without them the precision is the inverse of the draws' covariance everywhere, which is too small
        where the posterior is curved. The experiment starts at rest at zero; where the posterior was sampled
        with free initial conditions, its own initial state is unknown under its prior about zero.
        """
        given = posterior.axis
        starts = None if given.start_positions is None else np.zeros(1)
        axis = AxisParameters(
            given.model,
            given.free,
            output_scale=given.output_scale,
            start_positions=starts,
            held_poles=given.held_poles,
        )
        shared = [i for i, name in enumerate(axis.names) if not name.startswith("start")]
        rows = [given.names.index(axis.names[i]) for i in shared]
        n_given = len(given.names)
        flat = posterior.values.reshape(-1, posterior.values.shape[-1])
        shared_parameters = tuple(axis.parameters[i] for i in shared)
        known = np.atleast_2d(np.cov(as_coordinates(shared_parameters, flat[:, rows].T)))
        known += LEAST_VARIANCE * np.diag(np.diag(known))
        chosen = posterior.draws(draws, rng)
        sigma = chosen[:, n_given]
        partial = chosen[:, n_given + 1 : n_given + 1 + posterior.noise_order].T
        if records:
            near = _local_precision(given, chosen[:, :n_given], records, sigma, partial, rows)
        else:
            near = np.repeat(np.linalg.inv(known)[None], len(chosen), axis=0)
        values = np.tile(axis.nominal, (len(chosen), 1))
        values[:, shared] = chosen[:, rows]
        variances = np.array([_start_variance(parameter) for parameter in axis.parameters])
        covariance = np.diag(variances)
        covariance[np.ix_(shared, shared)] = known
        own = np.diag([1 / variance if variance > 0 else 0.0 for variance in variances])
        precision = np.repeat(own[None], len(chosen), axis=0)
        precision[:, np.array(shared)[:, None], shared] = near
        return cls(axis, values, covariance, precision, sigma, partial)

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
    return laplace_gain(belief.covariance, belief.precision, np.nan_to_num(information), about)


def laplace_gain(
    covariance: FloatArray, precision: FloatArray, information: FloatArray, about: Sequence[int]
) -> ExpectedGain:
    """The gain for a belief of that covariance (parameters, parameters) from what was known and what is added
    near each draw, `precision` and `information` (draws, parameters, parameters)."""
    left = scaled_inverse(precision + information)
    chosen = np.ix_(about, about)
    before = np.linalg.slogdet(covariance[chosen])[1]
    after = np.linalg.slogdet(np.stack([each[chosen] for each in left]))[1]
    gains = 0.5 * (before - after)
    error = float(np.std(gains, ddof=1) / np.sqrt(len(gains))) if len(gains) > 1 else float("nan")
    return ExpectedGain(float(np.mean(gains)), error, left)


def scaled_inverse(precision: FloatArray) -> FloatArray:
    """Inverses of positive matrices (..., n, n), each row and column scaled to a unit diagonal first."""
    scale = 1 / np.sqrt(np.diagonal(precision, axis1=-2, axis2=-1))
    both = scale[..., :, None] * scale[..., None, :]
    return np.asarray(np.linalg.inv(precision * both) * both)


def predicted_widths(belief: Belief, covariances: FloatArray) -> FloatArray:
    """Widths (draws, parameters) in values of the 94 % intervals, central in coordinates, that an experiment
    would leave if each draw of the belief were the truth."""
    reach = float(special.ndtri(0.5 + INTERVAL_PROBABILITY / 2))
    parameters = belief.axis.parameters
    centre = as_coordinates(parameters, belief.values.T)
    sd = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2)).T
    low, high = (as_values(parameters, centre + side * reach * sd) for side in (-1, 1))
    return np.abs(high - low).T


def _local_precision(
    axis: AxisParameters,
    values: FloatArray,
    records: Sequence[Record],
    sigma: FloatArray,
    partial: FloatArray,
    rows: Sequence[int],
) -> FloatArray:
    """Precision (draws, rows, rows) of the parameters `rows` near `values` (draws, parameters): the priors'
    and the Fisher information of the records, other parameters (initial states) integrated out."""
    innovation_sigma = sigma * np.sqrt(np.prod(1 - partial**2, axis=0))
    information = fisher_information(
        axis, values.T, records, autoregression_from_partial(partial), innovation_sigma
    )
    _, prior_sd = prior_scale(axis)
    everything = scaled_inverse(np.nan_to_num(information) + np.diag(prior_sd**-2))
    return scaled_inverse(everything[:, np.array(rows)[:, None], rows])


def _start_variance(parameter: Parameter) -> float:
    """Prior variance of an initial state; zero for what the posterior knows."""
    _, sd = parameter.prior.of_value or (0.0, 0.0)
    return sd**2
