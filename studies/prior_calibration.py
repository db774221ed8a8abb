"""Simulation-based calibration: are the posterior's intervals right, from the priors to the ranks?

Parameters are drawn from the priors, a record is simulated with them, and the posterior is sampled the
same way as for a measured record. Over many replicates the rank of the true value among independent posterior
draws is uniform, and an interval of probability p holds the truth in a share p of them (Talts et al.,
arXiv 1804.06788). The log-likelihood is ranked as well: it tells a posterior that ignores the data, which the
parameters do not (Modrák et al., doi 10.1214/23-BA1404).

The argument needs priors that do not look at the data: those of the noise, which `infer` centres on an
estimate, are centred here on the nominal noise of the case.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.identify.noise import NoiseEstimate, estimate_noise, stationary_autoregression
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.infer.inference import residual_report
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.reparameterisation import Reparameterisation
from bayes_hw.infer.sampler import SamplerSettings, Sampling, sample
from bayes_hw.infer.starting_point import noise_covariance, starting_point
from bayes_hw.infer.summary import highest_density_interval
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import Parameter, as_coordinates, as_values
from bayes_hw.model.priors import LogNormal
from bayes_hw.record import Record

LOG_LIKELIHOOD = "log_likelihood"
PROBABILITIES = (0.5, 0.8, 0.94)
DRAWS = 127
"""Draws that the truth is ranked among: 128 possible ranks fall into bins without remainder."""

CALIBRATION_SETTINGS = SamplerSettings(walkers=64, max_steps=1000, target_ess=400.0)


@dataclass(frozen=True, eq=False)
class CalibrationCase:
    """What is simulated, and with which likelihood it is sampled.

    The axis has the priors that `infer` gives `model`; its nominal dead zone must not be zero, because that
    prior would then look at the data. The noise has `model.noise_sigma` and the partial autocorrelations
    `partial` as its nominal values and the priors of `infer` about them; with `fixed_partial` the simulated
    noise has just those partial autocorrelations. `command` has shape (samples,), units of u.

    `assumed_order` and `sigma_factor` make the likelihood wrong on purpose: an AR order other than that of
    the simulated noise, and a standard deviation that is taken to be `sigma_factor` times its parameter.
    `prior_width` multiplies the standard deviation of every log-normal prior, in the draws and in the
    posterior alike: narrower priors make replicates that are sampled in a second or two.
    """

    model: HammersteinWiener
    command: FloatArray
    partial: tuple[float, ...] = (0.5,)
    fixed_partial: bool = False
    assumed_order: int | None = None
    sigma_factor: float = 1.0
    prior_width: float = 1.0
    settings: SamplerSettings = CALIBRATION_SETTINGS

    def __post_init__(self) -> None:
        if not (self.model.dead_zone.half_width > 0 and self.model.noise_sigma > 0):
            raise InputError(
                f"{self.model.name}: calibration needs priors that do not look at the data;"
                " give dead_zone.half_width and noise.sigma above zero"
            )

    @property
    def axis(self) -> AxisParameters:
        axis = AxisParameters(self.model)
        axis.parameters = tuple(self._narrowed(parameter) for parameter in axis.parameters)
        return axis

    def noise(self, order: int | None = None) -> tuple[Parameter, ...]:
        """The noise parameters of that AR order, of the simulated noise's own when None."""
        partial = np.zeros(len(self.partial) if order is None else order)
        common = min(len(partial), len(self.partial))
        partial[:common] = self.partial[:common]
        nominal = NoiseEstimate(self.model.noise_sigma, partial)
        return tuple(map(self._narrowed, noise_parameters(nominal, self.model.units.output)))

    def _narrowed(self, parameter: Parameter) -> Parameter:
        if not isinstance(parameter.prior, LogNormal):
            return parameter
        return replace(
            parameter, prior=replace(parameter.prior, log_sd=self.prior_width * parameter.prior.log_sd)
        )


class MisscaledLogPosterior(LogPosterior):
    """A wrong log-posterior that a calibration has to find out: it takes the noise's standard deviation to be
    `sigma_factor` times what its parameter says."""

    sigma_factor = 1.0

    def log_likelihood(self, values: FloatArray) -> FloatArray:
        scaled = values.copy()
        scaled[len(self.axis.parameters)] *= self.sigma_factor
        return super().log_likelihood(scaled)


def calibration_tasks(
    case: CalibrationCase, replicates: int, seed: int
) -> list[tuple[CalibrationCase, np.random.SeedSequence]]:
    """One task of `calibrate_once` a replicate."""
    return [(case, child) for child in np.random.SeedSequence(seed).spawn(replicates)]


def calibrate_once(task: tuple[CalibrationCase, np.random.SeedSequence]) -> dict[str, Any]:
    """One replicate, as plain data.

    `ranks` of the true values and of their log-likelihood among DRAWS draws; `inside`, for every parameter
    whether its central intervals of PROBABILITIES and its 94 % HDI hold the truth; `converged` and
    `problems`; `failed_tests` of the residuals; `seconds`. A partial autocorrelation that the likelihood has
    and the simulated noise has not is zero in truth.
    """
    case, seed = task
    begin = time.perf_counter()
    truth_rng, start_rng, sampler_rng, rank_rng = np.random.default_rng(seed).spawn(4)
    axis = case.axis
    truth = draw_from_prior(axis, case.noise(), truth_rng)
    if case.fixed_partial:
        truth[len(axis.parameters) + 1 :] = case.partial
    record = simulated_record(case, truth, truth_rng)
    target, sampling = _sampled(case, record, start_rng, sampler_rng)
    values = target.values(independent_draws(sampling))
    shared = np.zeros(target.dimension)
    common = min(target.dimension, len(truth))
    shared[:common] = truth[:common]
    quantities = np.column_stack([values, target.log_likelihood(values.T)])
    true_quantities = np.append(shared, target.log_likelihood(shared[:, None]))
    chosen = rank_rng.choice(len(quantities), size=DRAWS, replace=False)
    ranks = np.count_nonzero(quantities[chosen] < true_quantities, axis=0)
    posterior = _posterior(target, sampling)
    draws = posterior.values.reshape(-1, target.dimension)
    return {
        "ranks": dict(zip((*target.names, LOG_LIKELIHOOD), ranks.tolist(), strict=True)),
        "inside": {
            name: [
                *(_in_central_interval(draws[:, i], shared[i], p) for p in PROBABILITIES),
                _in_hdi(draws[:, i], shared[i]),
            ]
            for i, name in enumerate(target.names)
        },
        "converged": posterior.converged,
        "problems": list(posterior.problems),
        "failed_tests": [
            test.name for test in residual_report(posterior, (record,)).tests if not test.passed
        ],
        "seconds": time.perf_counter() - begin,
    }


def draw_from_prior(
    axis: AxisParameters, noise: tuple[Parameter, ...], rng: np.random.Generator
) -> FloatArray:
    """Values (parameters,) of axis and noise, with the dominant modes in order of frequency."""
    parameters = (*axis.parameters, *noise)
    while True:
        uniform = rng.random(len(parameters))
        values = np.array(
            [float(p.prior.quantile(np.asarray(x))) for p, x in zip(parameters, uniform, strict=True)]
        )
        if axis.in_order(values[: len(axis.parameters), None])[0]:
            return values


def simulated_record(case: CalibrationCase, truth: FloatArray, rng: np.random.Generator) -> Record:
    """The record of an axis with the parameters `truth` (parameters,): filtered in the time domain by the
    model itself, not by the compiled kernel, plus stationary AR noise."""
    axis = case.axis
    n_axis = len(axis.parameters)
    clean = axis.to_model(truth[:n_axis]).simulate(case.command).y
    noise = stationary_autoregression(len(clean), truth[n_axis], truth[n_axis + 1 :], rng)
    rate = case.model.sample_rate_hz
    t = np.arange(len(clean)) / rate
    return Record("replicate", t, case.command, clean + noise, rate, case.model.units)


def independent_draws(sampling: Sampling) -> FloatArray:
    """Draws (at least DRAWS, parameters) in coordinates: all walkers at steps one autocorrelation time apart,
    or closer where a chain that has not converged would leave fewer than DRAWS."""
    ensembles, steps, walkers, dimension = sampling.chain.shape
    needed = -(-DRAWS // (ensembles * walkers))
    longest = float(np.max(sampling.convergence.autocorrelation_time))
    spacing = int(np.clip(np.ceil(longest), 1, steps // needed))
    return sampling.chain[:, ::-spacing].reshape(-1, dimension)


def _sampled(
    case: CalibrationCase,
    record: Record,
    start_rng: np.random.Generator,
    sampler_rng: np.random.Generator,
) -> tuple[LogPosterior, Sampling]:
    """Start and sample as `infer` does, but with the noise parameters and the likelihood of the case."""
    axis, records = case.axis, (record,)
    order = len(case.partial) if case.assumed_order is None else case.assumed_order
    noise = case.noise(order)

    def target() -> LogPosterior:
        if case.sigma_factor == 1:
            return LogPosterior(axis, noise, records)
        wrong = MisscaledLogPosterior(axis, noise, records)
        wrong.sigma_factor = case.sigma_factor
        return wrong

    origin = starting_point(axis, records, start_rng)
    n_axis = len(axis.parameters)
    coordinates = origin.coordinates[:n_axis]
    values = as_values(axis.parameters, coordinates)
    residual = record.y - simulated_outputs(axis, values[:, None], records)[0][0]
    estimate = estimate_noise([residual], order)
    noise_mode = as_coordinates(noise, np.array([estimate.sigma / case.sigma_factor, *estimate.partial]))
    covariance = np.zeros((n_axis + len(noise), n_axis + len(noise)))
    covariance[n_axis:, n_axis:] = noise_covariance(estimate, len(record))
    covariance[:n_axis, :n_axis] = origin.covariance[:n_axis, :n_axis]
    mode = np.concatenate([coordinates, noise_mode])
    reparameterisation = Reparameterisation.of(axis.parameters, records)
    sampling = sample(
        target, mode, covariance, sampler_rng, settings=case.settings, reparameterisation=reparameterisation
    )
    return target(), sampling


def _posterior(target: LogPosterior, sampling: Sampling) -> Posterior:
    values = target.values(sampling.chain)
    return Posterior(
        axis=target.axis,
        noise_parameters=target.noise,
        values=values,
        log_probability=sampling.log_probability,
        point_estimate=values.mean(axis=(0, 1, 2)),
        converged=sampling.convergence.converged,
        problems=sampling.convergence.problems,
        seconds=sampling.seconds,
        convergence=sampling.convergence,
    )


def _in_central_interval(draws: FloatArray, truth: float, probability: float) -> bool:
    low, high = np.quantile(draws, [(1 - probability) / 2, (1 + probability) / 2])
    return bool(low <= truth <= high)


def _in_hdi(draws: FloatArray, truth: float) -> bool:
    low, high = highest_density_interval(draws)
    return bool(low <= truth <= high)
