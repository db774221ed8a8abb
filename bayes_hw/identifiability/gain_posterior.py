"""The posterior with gains and thresholds set free: its ridge, and the same in a normalized chart."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.freed_gains import (
    ALL_FREED,
    ASYMMETRIES,
    GAIN,
    GAIN_NEGATIVE,
    GAIN_POSITIVE,
    HALF_WIDTH_NEGATIVE,
    HALF_WIDTH_POSITIVE,
    LOWER,
    SLOPE,
    UPPER,
    FreedGains,
)
from bayes_hw.identifiability.scaling_group import Exponents, exponent_vector
from bayes_hw.identify.noise import NoiseEstimate, estimate_noise
from bayes_hw.identify.output_error import fit_output_error, prior_scale
from bayes_hw.infer.inference import Inference
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.sampler import SamplerSettings, Sampling, sample
from bayes_hw.infer.starting_point import (
    REFITS,
    covariance_with_prior,
    loosen_flat_directions,
    noise_covariance,
    split_by_record,
)
from bayes_hw.model.parameters import Parameter, as_coordinates, as_values
from bayes_hw.progress import Progress
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread

CHART: dict[str, Exponents] = {
    LOWER: {LOWER: 1.0, SLOPE: -1.0},
    UPPER: {UPPER: 1.0, SLOPE: -1.0},
    HALF_WIDTH_POSITIVE: {HALF_WIDTH_POSITIVE: 1.0, GAIN_POSITIVE: 1.0},
    GAIN: {SLOPE: 1.0, GAIN: 1.0, GAIN_POSITIVE: 1.0},
    GAIN_NEGATIVE: {GAIN_NEGATIVE: 1.0, GAIN_POSITIVE: -1.0},
    HALF_WIDTH_NEGATIVE: {HALF_WIDTH_NEGATIVE: 1.0, GAIN_POSITIVE: 1.0},
}
"""The parameters of the chart c1 = c2 = 1 as invariants of the freed ones."""


ALONG = (SLOPE, GAIN_POSITIVE)
"""The freed parameters whose logarithms are coordinates along the orbits."""

ORBIT_LOG_SD = 0.4
"""Width along the orbits at which sampling starts; priors pooled there leave about as much."""


class ChartPosterior(LogPosterior):
    """The log-posterior in the chart c1 = c2 = 1 under the prior that the freed parameters imply there.

    Independent log-normal priors of the freed parameters make the logarithms of the invariants jointly
    normal: A mean, A covariance A^T with A the exponents of CHART. That density takes the place of the
    chart's own independent priors, so that posteriors of invariants must equal those of the freed run.
    """

    def __init__(
        self,
        axis: FreedGains,
        noise: tuple[Parameter, ...],
        records: Sequence[Record],
        freed: FreedGains,
    ) -> None:
        super().__init__(axis, noise, records)
        self._rows = np.array([axis.names.index(name) for name in CHART])
        exponents = np.stack([exponent_vector(CHART[name], freed.names) for name in CHART])
        mean, variance = _log_normal_moments(freed.parameters)
        self._implied_mean = exponents @ mean
        self._implied_precision = np.linalg.inv((exponents * variance) @ exponents.T)
        own_mean, own_variance = _log_normal_moments(axis.parameters)
        self._own_mean, self._own_variance = own_mean[self._rows], own_variance[self._rows]

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        logs = coordinates[:, self._rows]
        from_implied, from_own = logs - self._implied_mean, logs - self._own_mean
        implied = -0.5 * np.einsum("wi,ij,wj->w", from_implied, self._implied_precision, from_implied)
        own = -0.5 * np.sum(from_own**2 / self._own_variance, axis=1)
        return super().__call__(coordinates) + implied - own


class FreedRuns(NamedTuple):
    """Posteriors with all of ALL_FREED free and in the chart c1 = c2 = 1, and the noise both start from."""

    freed: Posterior
    chart: Posterior
    noise: NoiseEstimate


class AlignedPosterior:
    """The log-posterior of the freed parameters in coordinates along and across the orbits.

    The parameters of the chart c1 = c2 = 1 (across), log c1 and log c2 (along), then the noise's: a linear
    map of the logarithms with determinant one. Raw parameters are so tightly correlated on the ridge that
    precise records would leave their covariance singular in floating point.
    """

    def __init__(self, posterior: LogPosterior, chart: FreedGains) -> None:
        self._posterior = posterior
        self.non_finite = 0
        freed = posterior.axis.names
        rows = [exponent_vector(CHART.get(name, {name: 1.0}), freed) for name in chart.names]
        rows += [exponent_vector({name: 1.0}, freed) for name in ALONG]
        count = len(freed)
        self._to_raw = np.eye(posterior.dimension)
        self._to_raw[:count, :count] = np.linalg.inv(np.stack(rows))
        self._names = (*chart.names, *ALONG, *(parameter.name for parameter in posterior.noise))

    @property
    def names(self) -> tuple[str, ...]:
        return self._names

    def raw(self, aligned: FloatArray) -> FloatArray:
        """Coordinates (..., parameters) of the freed parameters."""
        return np.asarray(aligned @ self._to_raw.T)

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        result = self._posterior(self.raw(coordinates))
        self.non_finite = self._posterior.non_finite
        return result


def sample_freed(
    inference: Inference,
    records: Sequence[Record],
    rng: np.random.Generator,
    *,
    settings: SamplerSettings | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
) -> FreedRuns:
    """The posterior with all of ALL_FREED free, and that in the chart c1 = c2 = 1 under the same prior.

    The second keeps c3 and the negative threshold free, so that the two differ by the normalization alone.
    Both start from the estimate of `inference`; their noise parameters are centred on what the chart's own
    least-squares fit leaves, since unequal gains would otherwise pass for noise.
    """
    given = inference.posterior.axis
    scale, starts = given.output_scale, given.start_positions
    freed = FreedGains(given.model, ALL_FREED, output_scale=scale, start_positions=starts)
    chart = FreedGains(given.model, ASYMMETRIES, output_scale=scale, start_positions=starts)
    estimate = as_values(given.parameters, inference.start.coordinates[: len(given.parameters)])
    freed_rng, chart_rng = rng.spawn(2)
    with one_blas_thread():
        values, noise = _chart_fit(chart, chart.embedded(estimate, given.names), records)
        sampled_noise = noise_parameters(noise, given.model.units.output)

        def freed_target() -> LogPosterior:
            return LogPosterior(freed, sampled_noise, records)

        def chart_target() -> LogPosterior:
            return ChartPosterior(chart, sampled_noise, records, freed)

        coordinates, covariance = _start(chart_target(), values, noise)
        in_chart = sample(
            chart_target,
            coordinates,
            covariance,
            chart_rng,
            settings=settings,
            jobs=jobs,
            progress=progress,
        )
        place, count = len(chart.names), len(ALONG)
        aligned = sample(
            lambda: AlignedPosterior(freed_target(), chart),
            np.insert(coordinates, place, np.zeros(count)),
            _with_orbits(covariance, place, count),
            freed_rng,
            settings=settings,
            jobs=jobs,
            progress=progress,
        )
    raw = AlignedPosterior(freed_target(), chart).raw
    return FreedRuns(
        _posterior(
            freed_target(), raw(aligned.chain), raw(np.insert(coordinates, place, np.zeros(count))), aligned
        ),
        _posterior(chart_target(), in_chart.chain, coordinates, in_chart),
        noise,
    )


def _with_orbits(covariance: FloatArray, place: int, count: int) -> FloatArray:
    """The chart's covariance with `count` rows at `place` for the coordinates along the orbits."""
    kept = np.delete(np.arange(len(covariance) + count), np.arange(place, place + count))
    larger = ORBIT_LOG_SD**2 * np.eye(len(covariance) + count)
    larger[np.ix_(kept, kept)] = covariance
    return larger


def _posterior(target: LogPosterior, chain: FloatArray, point: FloatArray, sampling: Sampling) -> Posterior:
    return Posterior(
        axis=target.axis,
        noise_parameters=target.noise,
        values=target.values(chain),
        log_probability=sampling.log_probability,
        point_estimate=target.values(point),
        converged=sampling.convergence.converged,
        problems=sampling.convergence.problems,
        seconds=sampling.seconds,
        convergence=sampling.convergence,
    )


def _chart_fit(
    chart: FreedGains, start: FloatArray, records: Sequence[Record]
) -> tuple[FloatArray, NoiseEstimate]:
    """Least-squares values (parameters,) in the chart and the noise that they leave.

    Plain residuals first: whitening by the noise of a poorer fit would hide what equal gains could not say.
    """
    plain = fit_output_error(chart, records, start)
    values, noise = plain.values, estimate_noise(split_by_record(plain.residuals, records))
    for _ in range(REFITS):
        fit = fit_output_error(
            chart,
            records,
            values,
            autoregression=noise.autoregression,
            sigma=noise.innovation_sigma,
            prior=True,
        )
        values = fit.values
        noise = estimate_noise(split_by_record(fit.residuals, records))
    return values, noise


def _start(target: LogPosterior, start: FloatArray, noise: NoiseEstimate) -> tuple[FloatArray, FloatArray]:
    """Mode and covariance in coordinates, from values (parameters,) near the mode."""
    axis, records = target.axis, target.records
    fit = fit_output_error(
        axis,
        records,
        start,
        autoregression=noise.autoregression,
        sigma=noise.innovation_sigma,
        prior=True,
    )
    _, prior_sd = prior_scale(axis)
    n_axis, samples = len(axis.parameters), sum(len(record) for record in records)
    covariance = np.zeros((target.dimension,) * 2)
    covariance[:n_axis, :n_axis] = covariance_with_prior(fit.information, prior_sd)
    covariance[n_axis:, n_axis:] = noise_covariance(noise, samples)
    noise_nominal = np.array([parameter.nominal for parameter in target.noise])
    coordinates = np.concatenate([fit.coordinates, as_coordinates(target.noise, noise_nominal)])
    loosen_flat_directions(target, coordinates, covariance, prior_sd)
    return coordinates, covariance


def implied_log_sd(name: str, freed: Sequence[Parameter]) -> float:
    """Standard deviation of the logarithm of one of CHART under the priors of the freed parameters."""
    _, variance = _log_normal_moments(freed)
    return float(np.sqrt(exponent_vector(CHART[name], [p.name for p in freed]) ** 2 @ variance))


def _log_normal_moments(parameters: Sequence[Parameter]) -> tuple[FloatArray, FloatArray]:
    """Mean and variance of log |value|; zero where the prior is not log-normal, which no exponent meets."""
    mean, sd = np.array([p.prior.of_logarithm or (0.0, 0.0) for p in parameters]).T
    return mean, sd**2
