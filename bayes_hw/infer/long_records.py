"""Sampling records of any length: a start on a part, least squares on all, an expanded likelihood, weights.

A likelihood that simulates every sample costs as much a step as the records are long. From LONG_SAMPLES on
the sampler walks on `bayes_hw.infer.long_records.Expansion`, and draws of its chain are weighed by the
likelihood of all samples and drawn again: the tail of the weights (Vehtari et al., Pareto smoothed importance
sampling, doi 10.48550/arXiv.1507.02646) says whether the expansion holds.

The log-posterior of long records with their residuals expanded to second order.

With many samples the posterior is narrow, and over it the residuals are nearly a quadratic function of the
coordinates. Their whitened products, taken once over all samples, then give the likelihood anywhere near at
a cost that does not depend on how long the records are:

    e(theta) = e(0) + sum_i z_i e_i + sum_(i <= j) z_i z_j e_ij,    theta = centre + factor z

so that the sum of squares is m' P m, m the monomials of z and P the products of the e. Divided differences
over STEP standard deviations give the e. The whitening is that of the noise at the centre; what the noise's
own coordinates change is exact there and carried over, since information on noise and response is
independent in large samples (Ljung, System Identification, sec. 9.4).
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.noise import NoiseEstimate, estimate_noise
from bayes_hw.identify.output_error import prior_scale
from bayes_hw.identify.several_starts import fit_from_several_starts
from bayes_hw.infer.checkpoint import Checkpoint
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.reparameterisation import Reparameterisation
from bayes_hw.infer.reweighting import Reweighting, reweighted
from bayes_hw.infer.sampler import SamplerSettings, Sampling, sample
from bayes_hw.infer.starting_point import (
    StartingPoint,
    covariance_with_prior,
    loosen_flat_directions,
    noise_covariance,
)
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.kernel import LaggedSums, lagged_residual_sums
from bayes_hw.model.parameters import ParameterVector, as_coordinates, as_values
from bayes_hw.model.streaming import simulated_blocks
from bayes_hw.progress import Progress
from bayes_hw.record import Record

STEP = 1.5
"""Of the divided differences, in standard deviations."""

FARTHEST = 12.0
"""Standard deviations from the centre beyond which the expansion means nothing and counts as impossible."""


class Expansion:
    """log p(coordinates | records) as `LogPosterior` has it, the residuals expanded about `centre`.

    `centre` (parameters,) and `covariance` (parameters, parameters) are of all coordinates; those of the
    noise come last.
    """

    def __init__(self, target: LogPosterior, centre: FloatArray, covariance: FloatArray) -> None:
        axis, n_axis = target.axis, len(target.axis.parameters)
        self.target = target
        self.non_finite = 0
        self._centre = centre[:n_axis].copy()
        factor = np.linalg.cholesky(covariance[:n_axis, :n_axis])
        self._to_standard = np.linalg.inv(factor)
        self._vector = ParameterVector(target.parameters)
        partial = target.values(centre[None])[0, n_axis + 1 : n_axis + 1 + target.order]
        points, differences = _stencil(n_axis)
        rows = whitened_products(
            axis, target.records, self._centre[:, None] + factor @ points.T, Whitener.of_partial(partial)
        )
        self._products = differences @ rows @ differences.T
        self._sums = self._sums_at_centre()

    @property
    def names(self) -> tuple[str, ...]:
        return self.target.names

    def __call__(self, coordinates: FloatArray) -> FloatArray:
        """Log-posterior density (walkers,) of coordinates (walkers, parameters)."""
        n_axis = len(self._centre)
        standard = (coordinates[:, :n_axis] - self._centre) @ self._to_standard.T
        columns = np.ascontiguousarray(coordinates.T)
        with np.errstate(all="ignore"):
            values = self._vector.values(columns)
            result = self._vector.log_prior(columns, values)
            possible = np.isfinite(result) & np.all(np.isfinite(values), axis=0)
            possible &= self.target.axis.in_order(values) & np.all(np.abs(standard) < FARTHEST, axis=1)
            sigma, partial = values[n_axis], values[n_axis + 1 :]
            innovation = sigma**2 * np.prod(1 - partial**2, axis=0)
            monomials = _monomials(standard)
            excess = np.einsum("nk,nk->n", monomials @ self._products, monomials) - self._products[0, 0]
            result += self.target.power * (self._at_centre(sigma, partial) - 0.5 * excess / innovation)
        result[~possible | ~np.isfinite(result)] = -np.inf
        return result

    def _sums_at_centre(self) -> list[LaggedSums]:
        axis, delay = self.target.axis, self.target.axis.model.linear.delay_samples
        values = as_values(axis.parameters, self._centre[:, None])
        found = []
        for number, record in enumerate(self.target.records):
            before = 0.0 if axis.start_positions is None else float(record.u[0])
            form = axis.modal_form(values, number)
            found.append(lagged_residual_sums(form, record.u, record.y, delay, self.target.order, before))
        return found

    def _at_centre(self, sigma: FloatArray, partial: FloatArray) -> FloatArray:
        """Exact log-likelihood (walkers,) of the residuals at the centre."""
        total = np.zeros(len(sigma))
        for number, sums in enumerate(self._sums):
            same = LaggedSums(*(np.repeat(part, len(sigma), axis=1) for part in sums))
            total += self.target.of_sums(same, number, sigma, partial)
        return total


def whitened_products(
    axis: AxisParameters, records: Sequence[Record], coordinates: FloatArray, whitener: Whitener
) -> FloatArray:
    """Products (points, points), over all samples, of the whitened residual at the first column of
    `coordinates` (axis parameters, points) and what the residuals of the others differ from it by; without
    what a level of a record explains, where that is free."""
    points, order = coordinates.shape[1], whitener.order
    values = as_values(axis.parameters, coordinates)
    products = np.zeros((points, points))
    for number, record in enumerate(records):
        form = axis.modal_form(values, number)
        before = 0.0 if axis.start_positions is None else float(record.u[0])
        kept = np.empty((points + 1, 0))
        own = np.zeros((points + 1, points + 1))
        for begin, y in simulated_blocks(form, record.u, axis.model.linear.delay_samples, before):
            rows = np.ones((points + 1, kept.shape[1] + y.shape[1]))
            rows[:, : kept.shape[1]] = kept
            rows[0, kept.shape[1] :] = record.y[begin : begin + y.shape[1]] - y[0]
            np.subtract(y[0], y[1:], out=rows[1:-1, kept.shape[1] :])
            innovations = whitener.apply(rows, kept.shape[1])
            own += innovations @ innovations.T
            kept = rows[:, rows.shape[1] - order :].copy()
        if record.has_free_level and axis.start_positions is None:
            own -= np.outer(own[-1], own[-1]) / own[-1, -1]
        products += own[:-1, :-1]
    return products


def _pairs(dimension: int) -> tuple[np.ndarray, np.ndarray]:
    return np.triu_indices(dimension, 1)


def _monomials(standard: FloatArray) -> FloatArray:
    """1, z_i, z_i^2, z_i z_j of points (points, dimension)."""
    i, j = _pairs(standard.shape[1])
    return np.concatenate(
        [np.ones((len(standard), 1)), standard, standard**2, standard[:, i] * standard[:, j]], axis=1
    )


def _stencil(dimension: int) -> tuple[FloatArray, FloatArray]:
    """Points (points, dimension) in standard coordinates, the centre first, and what of residuals there (the
    first itself, those of the others less it) gives the coefficients of the monomials, (monomials, points).
    """
    i, j = _pairs(dimension)
    one = np.eye(dimension)
    both = one[i] + one[j]
    points = STEP * np.concatenate([np.zeros((1, dimension)), one, -one, both, -both])
    count = len(i)
    plus, minus = 1 + np.arange(dimension), 1 + dimension + np.arange(dimension)
    plus_both = 1 + 2 * dimension + np.arange(count)
    minus_both = plus_both + count
    found = np.zeros((1 + 2 * dimension + count, len(points)))
    found[0, 0] = 1.0
    linear, square = 1 + np.arange(dimension), 1 + dimension + np.arange(dimension)
    mixed = 1 + 2 * dimension + np.arange(count)
    found[linear, plus], found[linear, minus] = 0.5 / STEP, -0.5 / STEP
    found[square, plus] = found[square, minus] = 0.5 / STEP**2
    found[mixed, plus_both] = found[mixed, minus_both] = 0.5 / STEP**2
    for side in (plus, minus):
        found[mixed, side[i]] = found[mixed, side[j]] = -0.5 / STEP**2
    return points, found


LONG_SAMPLES = 60_000
"""Samples of all records together from which on the likelihood is expanded."""

STARTS, START_SAMPLES = 4, 10_000
"""Descents from several starts, and samples of the beginnings of the records that they are made on."""

SWEEPS = 30
ENOUGH_NATS = 0.02
"""A sweep of least squares that gains less is the last."""

FIRST_STEP, STEP = 1e-5, 0.2
"""Of the difference quotients: at first in coordinates, later in standard deviations."""

DAMPINGS = np.array([0.0, *np.logspace(-8, 4, 13)])

ATTEMPTS = 2
MOST_WEIGHED = 544
"""Draws of every ensemble that the likelihood of all samples weighs."""


def are_long(records: Sequence[Record]) -> bool:
    """Whether the likelihood of these records is expanded: they are long, and every sample was measured."""
    whole = all(record.measured is None for record in records)
    return whole and sum(len(record) for record in records) >= LONG_SAMPLES


def beginnings(records: Sequence[Record]) -> tuple[list[Record], float]:
    """The first START_SAMPLES of all records together, and how many times as many samples there are."""
    times = max(1.0, sum(len(record) for record in records) / START_SAMPLES)
    return [record.split(1 / times)[0] if times > 1 else record for record in records], times


def start_of_long(axis: AxisParameters, records: Sequence[Record], rng: np.random.Generator) -> StartingPoint:
    """As `starting_point`: several starts on the beginnings of the records, then one descent on all samples.

    Memory does not grow with the records but for a few numbers a sample.
    """
    starts = fit_from_several_starts(axis, beginnings(records)[0], rng=rng, starts=STARTS)
    found = starts.best.values
    trials = [_noise_at(axis, records, values) for values in (axis.nominal, found)]
    better = int(trials[1].sigma < trials[0].sigma)
    values, noise = (axis.nominal, found)[better], trials[better]
    coordinates = as_coordinates(axis.parameters, axis.put_in_order(values))
    coordinates, covariance, noise = _descended(axis, records, coordinates, noise)
    sampled = noise_parameters(noise, axis.model.units.output)
    target = LogPosterior(axis, sampled, records)
    samples = sum(len(record) for record in records)
    everything = np.concatenate([coordinates, _noise_coordinates(noise, axis)])
    joined = np.asarray(linalg.block_diag(covariance, noise_covariance(noise, samples)))
    loosen_flat_directions(target, everything, joined, prior_scale(axis)[1])
    return StartingPoint(everything, joined, noise, sampled, starts)


def _noise_coordinates(noise: NoiseEstimate, axis: AxisParameters) -> FloatArray:
    values = np.concatenate([[noise.sigma], np.clip(noise.partial, -0.9999, 0.9999)])
    return as_coordinates(noise_parameters(noise, axis.model.units.output), values)


def _noise_at(axis: AxisParameters, records: Sequence[Record], values: FloatArray) -> NoiseEstimate:
    return estimate_noise(residuals_at(axis, records, values))


def residuals_at(axis: AxisParameters, records: Sequence[Record], values: FloatArray) -> list[FloatArray]:
    """Measured less simulated y of every record at `values` (axis parameters,), block by block."""
    found = []
    for number, record in enumerate(records):
        form = axis.modal_form(values[:, None], number)
        before = 0.0 if axis.start_positions is None else float(record.u[0])
        residual = record.y.copy()
        for begin, y in simulated_blocks(form, record.u, axis.model.linear.delay_samples, before):
            residual[begin : begin + y.shape[1]] -= y[0]
        found.append(residual)
    return found


def _descended(
    axis: AxisParameters, records: Sequence[Record], coordinates: FloatArray, noise: NoiseEstimate
) -> tuple[FloatArray, FloatArray, NoiseEstimate]:
    """Coordinates, their covariance and the noise, by Gauss-Newton with priors; of all dampings at once the
    one that the log-posterior likes best."""
    prior_mean, prior_sd = prior_scale(axis)
    size = len(coordinates)
    steps = np.full(size, FIRST_STEP)
    for _ in range(SWEEPS):
        whitener = Whitener.of_partial(np.clip(noise.partial, -0.9999, 0.9999))
        shifts = np.concatenate([np.zeros((size, 1)), np.diag(steps), -np.diag(steps)], axis=1)
        products = whitened_products(axis, records, coordinates[:, None] + shifts, whitener)
        slopes = np.zeros((size + 1, 2 * size + 1))
        slopes[0, 0] = 1.0
        rows = np.arange(size)
        slopes[1 + rows, 1 + rows], slopes[1 + rows, 1 + size + rows] = 0.5 / steps, -0.5 / steps
        reduced = slopes @ products @ slopes.T / noise.innovation_sigma**2
        information, gradient = reduced[1:, 1:], -reduced[1:, 0]
        covariance = covariance_with_prior(information, prior_sd)
        scaled = information * np.outer(prior_sd, prior_sd) + np.eye(size)
        slope = (gradient - (coordinates - prior_mean) / prior_sd**2) * prior_sd
        moves = [
            prior_sd * np.linalg.solve(scaled + damping * np.diag(np.diag(scaled)), slope)
            for damping in DAMPINGS
        ]
        trials = coordinates + np.array([np.zeros(size), *moves])
        target = LogPosterior(axis, noise_parameters(noise, axis.model.units.output), records)
        held = np.repeat(_noise_coordinates(noise, axis)[None], len(trials), axis=0)
        heights = target(np.concatenate([trials, held], axis=1))
        best = int(np.argmax(heights))
        gained = heights[best] - heights[0]
        coordinates = trials[best]
        noise = _noise_at(axis, records, as_values(axis.parameters, coordinates))
        steps = np.clip(STEP * np.sqrt(np.diag(covariance)), 1e-9, 1e-2)
        if best == 0 or gained < ENOUGH_NATS:
            break
    return coordinates, covariance, noise


def sample_long(
    target: LogPosterior,
    origin: StartingPoint,
    rng: np.random.Generator,
    *,
    settings: SamplerSettings,
    jobs: int,
    progress: Progress,
    checkpoint: Checkpoint | None,
    resume: bool,
) -> tuple[Sampling, Reweighting]:
    """Sample an expansion about `origin`, and decide on its draws by the likelihood of all samples.

    Where the weights do not hold, once more with an expansion about the weighted draws.
    """
    reparameterisation = Reparameterisation.of(target.axis.parameters, target.records)
    centre, covariance = origin.coordinates, origin.covariance
    for attempt in range(ATTEMPTS):
        with progress.stage("likelihood expanded over all samples"):
            expansion = Expansion(target, centre, covariance)
        sampler_rng, weight_rng = rng.spawn(2)
        sampling = sample(
            partial(copy.copy, expansion),
            centre,
            covariance,
            sampler_rng,
            settings=settings,
            reparameterisation=reparameterisation,
            jobs=jobs,
            progress=progress,
            checkpoint=checkpoint if attempt == 0 else None,
            resume=resume and attempt == 0,
        )
        with progress.stage("draws weighed by the likelihood of all samples"):
            states, heights, judged = reweighted(
                "expanded_likelihood",
                sampling.chain,
                sampling.log_probability,
                target,
                weight_rng,
                MOST_WEIGHED,
            )
        if judged.holds:
            break
        flat = states.reshape(-1, states.shape[-1])
        centre, covariance = flat.mean(axis=0), np.cov(flat.T)
    return replace(sampling, chain=states, log_probability=heights), judged
