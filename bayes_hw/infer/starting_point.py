"""Where sampling starts: the most probable parameters and the width of the posterior around them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np
from scipy import linalg, stats

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.criterion import DECISIVE
from bayes_hw.identify.growth.search import ABSORBED
from bayes_hw.identify.noise import NoiseEstimate, estimate_noise, samples_worth_one
from bayes_hw.identify.output_error import OutputErrorFit, fit_output_error, prior_scale, whitened
from bayes_hw.identify.several_starts import SeveralStarts, fit_from_several_starts
from bayes_hw.identify.whole_cascade import CARRIED
from bayes_hw.infer.improper_tails import onto_plains
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.noise import noise_parameters
from bayes_hw.infer.residual_tests import DEPENDENCE, examine_residuals, reach
from bayes_hw.model.axis_parameters import AxisParameters
from bayes_hw.model.parameters import Parameter, as_coordinates, as_values
from bayes_hw.record import Record

REFITS = 2
MOST_REORDERED = 3
"""Further fits where a descent has let poles change places: their numbers are given anew before each."""

ROUNDING = 1e-10
APART = 5.0
NEGLIGIBLE = 15.0
WORSE = 2.0
"""A minimum with so many times the smallest sum of squares is not looked at as a mode of its own."""
START_DEGREES = 6.0
DEGREES_VARIANCE = 0.3
"""Of log(degrees of freedom - 2) where sampling starts."""
NoiseKind: TypeAlias = Literal["normal", "student-t", "auto"]
PEAK_SHARE = 0.05
"""Of the posterior about the better of a peak and the plain beside it: with less the other is left out."""
FLAT_LOSS = 1.0
"""A direction is flat when one prior width along it costs less than this in log-likelihood."""


@dataclass(frozen=True, eq=False)
class StartingPoint:
    """Approximate posterior mode (parameters,) and covariance in coordinates, axis first, noise after it.

    `noise` is the noise estimated there, `noise_parameters` its sampled parameters; `starts` says whether
    descents from several starts agreed; `others` holds coordinates and covariance of further modes; `power`
    is that of the likelihood, below one where the model leaves far more than noise (see `starting_point`).
    """

    coordinates: FloatArray
    covariance: FloatArray
    noise: NoiseEstimate
    noise_parameters: tuple[Parameter, ...]
    starts: SeveralStarts
    others: tuple[tuple[FloatArray, FloatArray], ...] = ()
    power: float = 1.0


def starting_point(
    axis: AxisParameters,
    records: Sequence[Record],
    rng: np.random.Generator,
    noise_kind: NoiseKind = "auto",
) -> StartingPoint:
    """Least squares on plain residuals from several starts, then with AR noise and priors.

    Coloured noise enters last: with the parameters still wrong, whitening would absorb the misfit. The
    covariance is the Gauss-Newton one with the priors' curvature, and the large-sample one of the noise
    parameters; the two are independent.

    The innovations of the noise are "normal", "student-t", or "auto": Student t where that fits those of the
    estimate better by DECISIVE in the Bayesian information criterion. For Student t, outliers are drawn in to
    WINSOR standard deviations before the parameters are fitted again.

    Where coloured noise would leave CARRIED times the error of plain least squares, or hides ABSORBED times
    innovations that follow the command, the model does not hold and an autoregression would predict its
    misfit: the likelihood is then that of white noise to the power
    1 / tau, with tau the samples that are worth one, a composite likelihood (Ribatet, Cooley and Davison
    2012, doi 10.5705/ss.2009.248), whose mode simulates best.
    """
    starts = fit_from_several_starts(axis, records, rng=rng)
    noise, fit = _refitted(axis, records, starts.best)
    power = 1.0
    if fit.rms > CARRIED * starts.best.rms or _hides_misfit(noise, fit, records):
        noise, fit, power = _plainly(axis, records, starts.best)
    elif noise_kind == "student-t" or (noise_kind == "auto" and _heavy_tailed(noise, fit, records)):
        records, noise, fit = _robustly(axis, records, noise, fit)
    sampled = noise_parameters(noise, axis.model.units.output)
    coordinates, covariance = _with_noise(axis, fit, noise, sampled, power)
    target = LogPosterior(axis, sampled, records, power)
    others = _other_modes(target, records, starts, noise, (coordinates, covariance))
    modes = [(coordinates, covariance), *others]
    heights = target(np.stack([one[0] for one in modes]))
    modes = [modes[i] for i in np.argsort(-heights) if i == np.argmax(heights) or np.isfinite(heights[i])]
    first, *further = (along_the_plain(target, *one) for one in modes)
    mode, *beside = first
    others = [*beside, *(place for one in further for place in one)]
    return StartingPoint(*mode, noise, sampled, starts, tuple(others), power)


def along_the_plain(
    target: LogPosterior, coordinates: FloatArray, covariance: FloatArray
) -> list[tuple[FloatArray, FloatArray]]:
    """Mode and covariance with flat directions moved into the plain and given half the prior's width, and
    those of a peak that has given way to a plain, where it has PEAK_SHARE of what the other has; the one with
    more of the posterior first."""
    moved, widened = coordinates.copy(), covariance.copy()
    _, prior_sd = prior_scale(target.axis)
    if not loosen_flat_directions(target, moved, widened, prior_sd):
        return [(moved, widened)]
    places = [(moved, widened), (coordinates, covariance)]
    heights = target(np.stack([one for one, _ in places]))
    masses = [h + 0.5 * np.linalg.slogdet(c)[1] for h, (_, c) in zip(heights, places, strict=True)]
    best = int(np.argmax(masses))
    lesser = masses[1 - best] > masses[best] + np.log(PEAK_SHARE)
    return [places[best], *([places[1 - best]] if lesser else [])]


def _refitted(
    axis: AxisParameters, records: Sequence[Record], fit: OutputErrorFit, order: int | None = None
) -> tuple[NoiseEstimate, OutputErrorFit]:
    """The fit with AR noise (of the given order, or chosen) and priors, and the noise of its residuals."""
    for number in range(REFITS + MOST_REORDERED):
        if number >= REFITS and np.array_equal(axis.put_in_order(fit.values), fit.values):
            break
        noise = estimate_noise(split_by_record(fit.residuals, records), order)
        fit = fit_output_error(
            axis,
            records,
            axis.put_in_order(fit.values),
            autoregression=noise.autoregression,
            sigma=noise.innovation_sigma,
            prior=True,
        )
    return estimate_noise(split_by_record(fit.residuals, records), order), fit


def _plainly(
    axis: AxisParameters, records: Sequence[Record], fit: OutputErrorFit
) -> tuple[NoiseEstimate, OutputErrorFit, float]:
    """White noise, the fit under it with priors, and the power of its likelihood."""
    tau = samples_worth_one(split_by_record(fit.residuals, records))
    noise = estimate_noise(split_by_record(fit.residuals, records), 0)
    fit = fit_output_error(axis, records, fit.values, sigma=noise.sigma * float(np.sqrt(tau)), prior=True)
    return estimate_noise(split_by_record(fit.residuals, records), 0), fit, 1 / tau


def _hides_misfit(noise: NoiseEstimate, fit: OutputErrorFit, records: Sequence[Record]) -> bool:
    """Whether innovations that ABSORBED times as large residuals are predicted from follow the command."""
    if noise.sigma <= ABSORBED * noise.innovation_sigma:
        return False
    residuals = split_by_record(fit.residuals, records)
    tests = examine_residuals(records, residuals, noise.autoregression).tests
    return not all(test.passed for test in tests if test.name in DEPENDENCE)


def _innovations(noise: NoiseEstimate, fit: OutputErrorFit, records: Sequence[Record]) -> FloatArray:
    """Of all records, their first samples left out."""
    found = []
    for part, record in zip(split_by_record(fit.residuals, records), records, strict=True):
        innovations = whitened(part, noise.autoregression, record.measured)
        found.append(innovations[noise.order :][record.measured_samples[noise.order :]])
    return np.concatenate(found)


def _heavy_tailed(noise: NoiseEstimate, fit: OutputErrorFit, records: Sequence[Record]) -> bool:
    """Whether Student-t innovations fit better by DECISIVE in the Bayesian information criterion."""
    a = _innovations(noise, fit, records)
    degrees, _, scale = stats.t.fit(a, floc=0.0)
    gain = np.sum(stats.t.logpdf(a, degrees, 0.0, scale)) - np.sum(stats.norm.logpdf(a, 0.0, np.std(a)))
    return bool(2 * gain - np.log(len(a)) > DECISIVE)


def _robustly(
    axis: AxisParameters, records: Sequence[Record], noise: NoiseEstimate, fit: OutputErrorFit
) -> tuple[list[Record], NoiseEstimate, OutputErrorFit]:
    """Records with their outliers drawn in, and noise and fit of those, the noise with degrees of freedom.

    Residuals beyond WINSOR robust standard deviations of the median are moved there (Huber's pseudo-data),
    unless most of them are nothing.
    """
    drawn_in = list(records)
    for _ in range(REFITS):
        parts = [np.nan_to_num(part) for part in split_by_record(fit.residuals, drawn_in)]
        outputs = [record.y - part for record, part in zip(drawn_in, parts, strict=True)]
        residuals = [record.y - output for record, output in zip(records, outputs, strict=True)]
        known = [e[record.measured_samples] for e, record in zip(residuals, records, strict=True)]
        farthest = reach(known)
        if farthest < ROUNDING * float(np.max(np.abs(np.concatenate(known)))):
            break
        drawn_in = [
            replace(record, y=output + np.clip(residual, -farthest, farthest))
            for record, output, residual in zip(records, outputs, residuals, strict=True)
        ]
        noise, fit = _refitted(axis, drawn_in, fit)
    return drawn_in, replace(noise, degrees_of_freedom=START_DEGREES), fit


def _with_noise(
    axis: AxisParameters,
    fit: OutputErrorFit,
    noise: NoiseEstimate,
    sampled: tuple[Parameter, ...],
    power: float = 1.0,
) -> tuple[FloatArray, FloatArray]:
    """Coordinates and covariance of the axis and, after it, of the noise."""
    degrees = [] if noise.degrees_of_freedom is None else [noise.degrees_of_freedom]
    values = np.concatenate([[noise.sigma], np.clip(noise.partial, -0.9999, 0.9999), degrees])
    n_axis = len(axis.parameters)
    covariance = np.zeros((n_axis + len(sampled), n_axis + len(sampled)))
    _, prior_sd = prior_scale(axis)
    covariance[:n_axis, :n_axis] = covariance_with_prior(fit.information, prior_sd)
    covariance[n_axis:, n_axis:] = noise_covariance(noise, max(1, round(power * fit.samples)))
    return np.concatenate([fit.coordinates, as_coordinates(sampled, values)]), covariance


def _other_modes(
    target: LogPosterior,
    records: Sequence[Record],
    starts: SeveralStarts,
    noise: NoiseEstimate,
    best: tuple[FloatArray, FloatArray],
) -> list[tuple[FloatArray, FloatArray]]:
    """Coordinates and covariances of further modes that descents from other starts have found.

    A minimum counts where it is farther than APART from every mode already found, in widths of either, and
    its log-posterior no more than NEGLIGIBLE below that of the best.
    """
    found = [best]
    n_axis = len(target.axis.parameters)
    for fit in sorted(starts.fits, key=lambda one: one.sum_of_squares):
        near = [
            _distance(fit.coordinates, mode[:n_axis], covariance[:n_axis, :n_axis]) < APART
            for mode, covariance in found
        ]
        if any(near) or fit.sum_of_squares > WORSE * starts.sums_of_squares.min():
            continue
        own_noise, refitted = _refitted(target.axis, records, fit, noise.order)
        own_noise = replace(own_noise, degrees_of_freedom=noise.degrees_of_freedom)
        coordinates, covariance = _with_noise(target.axis, refitted, own_noise, target.noise)
        log_density = target(np.stack([best[0], coordinates]))
        apart = min(_distance(coordinates, mode, width) for mode, width in found) > APART
        if apart and log_density[1] > log_density[0] - NEGLIGIBLE:
            found.append((coordinates, covariance))
    return found[1:]


def _distance(a: FloatArray, b: FloatArray, covariance: FloatArray) -> float:
    """Mahalanobis distance of two points; zero where the covariance is too singular to tell."""
    widths = np.sqrt(np.maximum(np.diag(covariance), float(np.finfo(np.float64).tiny)))
    correlation = covariance / np.outer(widths, widths) + ROUNDING * np.eye(len(widths))
    difference = (a - b) / widths
    square = float(difference @ np.linalg.solve(correlation, difference))
    return float(np.sqrt(max(square, 0.0)))


def loosen_flat_directions(
    target: LogPosterior, coordinates: FloatArray, covariance: FloatArray, prior_sd: FloatArray
) -> bool:
    """Move each flat direction half a prior width onto its plain and make it as wide, in place; whether a
    peak has given way to a plain.

    On the plain the records say nothing of it that others would have to make up for: these have the
    covariance that they have given it.
    """
    rows, coordinates[:], information = onto_plains(target, coordinates, covariance, prior_sd, FLAT_LOSS)
    if information is not None:
        covariance[: len(prior_sd), : len(prior_sd)] = covariance_with_prior(information, prior_sd)
    for row, side in flat_directions(target, coordinates, prior_sd):
        if row not in rows:
            coordinates[row] += 0.5 * side * prior_sd[row]
            rows.append(row)
    for row in rows:
        covariance -= np.outer(covariance[row], covariance[row]) / covariance[row, row]
        covariance[row], covariance[:, row] = 0.0, 0.0
        covariance[row, row] = (0.5 * prior_sd[row]) ** 2
    return information is not None


def flat_directions(
    target: LogPosterior, coordinates: FloatArray, prior_sd: FloatArray
) -> list[tuple[int, int]]:
    """Axis parameters that the likelihood does not mind moving by one prior width, and to which side.

    A limit that no command reaches is one: least squares stops at the largest command, on the edge of a plain
    that the curvature there does not see.
    """
    steps = np.diag(prior_sd)
    n_axis = len(prior_sd)
    trials = np.repeat(coordinates[:, None], 2 * n_axis + 1, axis=1)
    trials[:n_axis, 1 : n_axis + 1] += steps
    trials[:n_axis, n_axis + 1 :] -= steps
    with np.errstate(all="ignore"):
        log_likelihood = np.nan_to_num(
            target.log_likelihood(as_values(target.parameters, trials)), nan=-np.inf
        )
    flat = log_likelihood[1:] > log_likelihood[0] - FLAT_LOSS
    return [(row, 1 if flat[row] else -1) for row in range(n_axis) if flat[row] or flat[n_axis + row]]


def split_by_record(residuals: FloatArray, records: Sequence[Record]) -> list[FloatArray]:
    """The concatenated residuals of all records as one array a record."""
    ends = np.cumsum([len(record) for record in records])[:-1]
    return np.split(residuals, ends)


def covariance_with_prior(information: FloatArray, prior_sd: FloatArray) -> FloatArray:
    """Inverse of the information plus the priors' precision, computed in units of the prior widths: in no
    direction less precise than the prior, whatever rounding has done to a large information."""
    values, vectors = np.linalg.eigh(information * np.outer(prior_sd, prior_sd) + np.eye(len(prior_sd)))
    inverse = (vectors / np.maximum(values, 1.0)) @ vectors.T
    return np.asarray(inverse * np.outer(prior_sd, prior_sd), dtype=np.float64)


def noise_covariance(noise: NoiseEstimate, samples: int) -> FloatArray:
    """Large-sample covariance of log sigma and the inverse hyperbolic tangents of the partial
    autocorrelations kappa, (1 + p, 1 + p); one row more for degrees of freedom, a guess.

    log sigma = log sigma_a - sum log(1 - kappa_i^2) / 2, where log sigma_a has variance 1 / (2 n) and is
    independent of the kappas. Each kappa is given the variance (1 - kappa^2) / n, that of the last one
    (Box, Jenkins and Reinsel, Time Series Analysis, sec. 7.2.6): exact for an AR(1), else an approximation.
    """
    partial = np.clip(noise.partial, -0.9999, 0.9999)
    independent = np.concatenate([[0.5], 1 / (1 - partial**2)]) / samples
    to_coordinates = np.eye(len(independent))
    to_coordinates[0, 1:] = partial
    covariance = (to_coordinates * independent) @ to_coordinates.T
    if noise.degrees_of_freedom is None:
        return covariance
    return np.asarray(linalg.block_diag(covariance, np.array([[DEGREES_VARIANCE]])))
