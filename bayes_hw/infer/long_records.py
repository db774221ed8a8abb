"""Sampling records of any length: a start on a part, least squares on all, an expanded likelihood, weights.

A likelihood that simulates every sample costs as much a step as the records are long. From LONG_SAMPLES on
the sampler walks on `bayes_hw.infer.expansion.Expansion`, and draws of its chain are weighed by the
likelihood of all samples and drawn again: the tail of the weights (Vehtari et al., Pareto smoothed importance
sampling, doi 10.48550/arXiv.1507.02646) says whether the expansion holds.
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
from bayes_hw.infer.expansion import Expansion, whitened_products
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
from bayes_hw.model.parameters import as_coordinates, as_values
from bayes_hw.model.streaming import simulated_blocks
from bayes_hw.progress import Progress
from bayes_hw.record import Record

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
