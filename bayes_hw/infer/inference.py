"""From a model and records to a posterior."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np

from bayes_hw import __version__
from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.identify.holes import with_holes, without_past
from bayes_hw.identify.noise import autoregression_from_partial
from bayes_hw.identify.output_error import levelled, simulated_outputs
from bayes_hw.infer.centred_weights import CentredWeights
from bayes_hw.infer.checkpoint import Checkpoint, fingerprint
from bayes_hw.infer.dead_zone_trade import trade_of
from bayes_hw.infer.following_weights import sample_followed
from bayes_hw.infer.laplace import CoordinateMap
from bayes_hw.infer.log_posterior import LogPosterior
from bayes_hw.infer.long_records import are_long, beginnings, sample_long, start_of_long
from bayes_hw.infer.noise import is_student_t, noise_order
from bayes_hw.infer.pole_labels import PoleLabels
from bayes_hw.infer.posterior import Posterior, extremes
from bayes_hw.infer.reparameterisation import Reparameterisation
from bayes_hw.infer.residual_tests import ResidualReport, examine_residuals
from bayes_hw.infer.reweighting import Reweighting
from bayes_hw.infer.sampler import SamplerSettings, Sampling, sample
from bayes_hw.infer.starting_point import NoiseKind, StartingPoint, starting_point
from bayes_hw.infer.unseen_poles import without_unseen_poles
from bayes_hw.model.axis_parameters import AxisParameters, FreeSet
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.sample_rate import check_rates
from bayes_hw.progress import Progress
from bayes_hw.record import Record
from bayes_hw.threads import one_blas_thread

Sampled: TypeAlias = Literal["all", "dominant", "conditional"]
"""What is sampled: the posterior of everything ("all"), the same with the weights of G's poles following the
rest ("dominant", see `bayes_hw.infer.following_weights`), or that of the dominant parameters with the rest of
G as it is ("conditional")."""

StartCondition: TypeAlias = Literal["rest", "free"]
START_SAMPLES = 5
DRAWS_TESTED = 64


@dataclass(frozen=True, eq=False)
class Inference:
    """A posterior with how it was found and what its residuals say."""

    posterior: Posterior
    sampling: Sampling
    start: StartingPoint
    residuals: ResidualReport


@dataclass(frozen=True, eq=False)
class Estimate:
    """Where sampling would begin: the axis, the estimate, the tests of its residuals."""

    axis: AxisParameters
    start: StartingPoint
    residuals: ResidualReport


def discard_checkpoint(folder: Path) -> None:
    """Remove the checkpoint of a run whose results have been written; its folder too if it is then empty."""
    Checkpoint(folder, "").clear()
    with suppress(OSError):
        folder.rmdir()


def axis_for(
    model: HammersteinWiener, records: Sequence[Record], free: FreeSet, start: StartCondition
) -> AxisParameters:
    """The free parameters of `model` for these records."""
    positions = None
    if start == "free":
        positions = np.array([float(np.mean(record.y[:START_SAMPLES])) for record in records])
    scale = max(float(np.max(np.abs(record.y - record.y[0]))) for record in records)
    return AxisParameters(model, free, output_scale=scale, start_positions=positions)


def told_by(model: HammersteinWiener, records: Sequence[Record], start: StartCondition) -> tuple[Record, ...]:
    """The records with what `model` can say something of measured: see `without_past` for those that begin in
    motion. Long ones stay whole, their expanded likelihood knows no holes."""
    if start == "rest" or are_long(records):
        return tuple(records)
    return without_past(records, model.linear.delay_samples)


def infer(
    model: HammersteinWiener,
    records: Sequence[Record],
    rng: np.random.Generator,
    *,
    free: Sampled = "all",
    start: StartCondition = "rest",
    noise: NoiseKind = "auto",
    settings: SamplerSettings | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
    checkpoint_folder: Path | None = None,
    resume: bool = False,
    estimate: Estimate | None = None,
) -> Inference:
    """Sample the posterior of `model`'s free parameters given `records`; `noise` as for `starting_point`,
    that of long records normal unless it is "student-t".

    Started from the least-squares estimate that several descents from `model` reach, or from `estimate`,
    which is that of the same arguments; see `starting_point` and `sample`. With `checkpoint_folder` the chain
    is kept there block by block.
    """
    begin = time.perf_counter()
    settings = settings or SamplerSettings()
    progress = progress or Progress(quiet=True)
    start_rng, sampler_rng = rng.spawn(2)
    found = estimate or estimated(
        model, records, start_rng, free=free, start=start, noise=noise, progress=progress
    )
    axis, origin = found.axis, found.start
    records = told_by(model, records, start)
    long = noise != "student-t" and are_long(records) and not model.known
    checkpoint = None
    if checkpoint_folder is not None:
        checkpoint = Checkpoint(
            checkpoint_folder,
            fingerprint(
                __version__,
                json.dumps(model.to_dict(), sort_keys=True),
                *[_data_digest(record) for record in records],
                free,
                start,
                noise,
                repr(settings),
                repr(rng.bit_generator.state),
            ),
        )
    target = LogPosterior(axis, origin.noise_parameters, records, origin.power)
    maps = _maps(axis, origin, target, records)
    instead: tuple[Sampling, Reweighting] | None = None
    with one_blas_thread():
        if long:
            instead = sample_long(
                target,
                origin,
                sampler_rng,
                settings=settings,
                jobs=jobs,
                progress=progress,
                checkpoint=checkpoint,
                resume=resume,
            )
        elif free == "dominant":
            instead = sample_followed(
                target, origin, maps[-1], sampler_rng, settings=settings, jobs=jobs, progress=progress
            )
        sampling, reweighting = instead or (None, None)
        if sampling is None or reweighting is None or not reweighting.holds:
            sampling = sample(
                lambda: LogPosterior(axis, origin.noise_parameters, records, origin.power),
                origin.coordinates,
                origin.covariance,
                sampler_rng,
                settings=settings,
                others=origin.others,
                reparameterisation=Reparameterisation.of(axis.parameters, records),
                maps=maps,
                jobs=jobs,
                progress=progress,
                checkpoint=checkpoint,
                resume=resume and not long,
            )
            reweighting = None
    values = target.values(sampling.chain)
    posterior = Posterior(
        axis=axis,
        noise_parameters=origin.noise_parameters,
        values=values,
        log_probability=sampling.log_probability,
        point_estimate=target.values(origin.coordinates),
        converged=sampling.convergence.converged,
        problems=sampling.convergence.problems,
        seconds=time.perf_counter() - begin,
        convergence=sampling.convergence,
        reweighting=reweighting,
        trade=trade_of(axis, values, records),
        power=origin.power,
        commanded=extremes(record.u for record in records),
    )
    residuals = residual_report(posterior, records)
    return Inference(replace(posterior, failed_tests=residuals.failures), sampling, origin, residuals)


def _maps(
    axis: AxisParameters, origin: StartingPoint, target: LogPosterior, records: Sequence[Record]
) -> list[list[CoordinateMap]]:
    """The coordinates that walkers move in: poles under their names at the estimate, weights centred, and at
    more cost initial states with them."""
    values = target.values(origin.coordinates)
    labels = PoleLabels.of(axis, origin.coordinates, origin.covariance)
    found: list[list[CoordinateMap]] = []
    for states in (False, True) if axis.start_rows else (False,):
        centred = CentredWeights.of(axis, values, origin.noise, records, origin.power, states)
        found.append([one for one in (labels, centred) if one is not None])
    return found


def estimated(
    model: HammersteinWiener,
    records: Sequence[Record],
    rng: np.random.Generator,
    *,
    free: Sampled = "all",
    start: StartCondition = "rest",
    noise: NoiseKind = "auto",
    progress: Progress | None = None,
) -> Estimate:
    """The least-squares estimate that sampling begins from, and the tests of its residuals.

    Raises InputError on options unknown, without any record and where rates differ.
    """
    for option, given, known in (
        ("free", free, get_args(Sampled)),
        ("start", start, get_args(StartCondition)),
        ("noise", noise, get_args(NoiseKind)),
    ):
        if given not in known:
            raise InputError(f"{option}={given!r}: unknown; use one of {', '.join(known)}")
    if not records:
        raise InputError("no record to sample from; give at least one")
    check_rates(model, records)
    records = told_by(model, records, start)
    axis = axis_for(model, records, "conditional" if free == "conditional" else "all", start)
    expanded = noise != "student-t" and are_long(records) and not model.known
    axis = without_unseen_poles(axis, *(beginnings(records) if expanded else (records, 1.0)))
    with one_blas_thread(), (progress or Progress(quiet=True)).stage("least squares from several starts"):
        origin = start_of_long(axis, records, rng) if expanded else starting_point(axis, records, rng, noise)
    return Estimate(axis, origin, _tested(axis, origin, records))


def _tested(axis: AxisParameters, origin: StartingPoint, records: Sequence[Record]) -> ResidualReport:
    values = LogPosterior(axis, origin.noise_parameters, records).values(origin.coordinates)
    return _residuals_at(axis, origin.noise_parameters, values, records)


def _data_digest(record: Record) -> str:
    """SHA-256 of what the likelihood sees of a record."""
    holes = b"" if record.measured is None else record.measured.tobytes()
    level = b"free level" if record.has_free_level else b""
    return hashlib.sha256(record.u.tobytes() + record.y.tobytes() + holes + level).hexdigest()


def residual_report(posterior: Posterior, records: Sequence[Record]) -> ResidualReport:
    """Residuals at the posterior mean (taken in coordinates), or at the likeliest of some draws where that is
    likelier than the mean by more than draws differ: poles that trade places have a mean that is no axis.
    Whitened and tested.
    """
    target = LogPosterior(posterior.axis, posterior.noise_parameters, records)
    drawn = target.coordinates(posterior.values.reshape(-1, posterior.values.shape[-1]))
    some = drawn[:: max(1, len(drawn) // DRAWS_TESTED)]
    centre = drawn.mean(axis=0)
    density = target(np.vstack([centre, some]))
    if not density[0] >= np.median(density[1:]):
        centre = some[int(np.argmax(density[1:]))]
    return _residuals_at(posterior.axis, posterior.noise_parameters, target.values(centre), records)


def _residuals_at(
    axis: AxisParameters, noise: Sequence[Parameter], values: FloatArray, records: Sequence[Record]
) -> ResidualReport:
    """Residuals at `values` (parameters,), those of the `noise` last, whitened by it and tested."""
    n_axis, order = len(axis.parameters), noise_order(noise)
    degrees = float(values[-1]) if is_student_t(noise) else None
    outputs = simulated_outputs(axis, values[:n_axis, None], records)
    autoregression = autoregression_from_partial(values[n_axis + 1 : n_axis + 1 + order, None])[:, 0]
    residuals: list[FloatArray] = [
        with_holes(levelled(axis, record, record.y - output[0], autoregression), record.measured)
        for record, output in zip(records, outputs, strict=True)
    ]
    return examine_residuals(records, residuals, autoregression, degrees_of_freedom=degrees)


def said_of(inference: Inference) -> tuple[str, ...]:
    """Whether the sampling has not converged, and whether the model leaves something of the records,
    and whether these are of a closed loop."""
    said = []
    if not inference.posterior.converged:
        said.append("NOT CONVERGED: " + "; ".join(inference.posterior.problems))
    if not inference.residuals.explained:
        said.append(
            f"the model explains little of the records (fit {inference.residuals.fit_percent:.0f} %):"
            " the noise model carries the rest"
        )
    if not inference.residuals.white:
        failed = next(test for test in inference.residuals.tests if not test.passed)
        said.append(f"the residuals are not white: {failed.name}: {failed.meaning}")
    if inference.residuals.feedback.closed_loop:
        said.append(inference.residuals.feedback.sentence)
    return tuple(said)
