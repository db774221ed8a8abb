"""The whole path for one axis: records, four-step estimate, posterior, bands."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import signal, stats

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap.joint.answer.known_model import with_known
from bayes_hw.identify.four_steps import identify
from bayes_hw.identify.holes import with_holes
from bayes_hw.identify.noise import estimate_noise
from bayes_hw.identify.result import Identification, RecordFit
from bayes_hw.identify.validation import evaluate
from bayes_hw.infer.convergence import autocorrelation_function
from bayes_hw.infer.inference import (
    Estimate,
    Inference,
    Sampled,
    StartCondition,
    discard_checkpoint,
    estimated,
    infer,
)
from bayes_hw.infer.own_check import OwnCheck
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.prediction import Coverage, Prediction, band_coverage, predict
from bayes_hw.infer.residual_tests import ResidualReport, examine_residuals
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.infer.starting_point import NoiseKind
from bayes_hw.infer.summary import INTERVAL_PROBABILITY
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.sample_rate import check_rates
from bayes_hw.progress import Progress
from bayes_hw.record import Record

COVERAGE_LEVELS = (0.5, 0.8, INTERVAL_PROBABILITY)
RESPONSE_POINTS = 400
RESPONSE_DRAWS = 400
LOWEST_RESPONSE_SHARE = 1e-3
AUTOCORRELATION_LAGS = 60


@dataclass(frozen=True, eq=False)
class ResponseBand:
    """G over frequency: the posterior's central 94 % in dB and degrees, all of shape (frequencies,).

    `model` is the response at the posterior mean, `baseline` that of the linear baseline where there is one.
    """

    frequency_hz: FloatArray
    model: ComplexArray
    baseline: ComplexArray | None
    magnitude_db: tuple[FloatArray, FloatArray]
    phase_deg: tuple[FloatArray, FloatArray]


@dataclass(frozen=True, eq=False)
class ResidualSpectrum:
    """Periodogram of the innovations and their quantiles beside those of a normal distribution."""

    frequency_hz: FloatArray
    density: FloatArray
    white_density: float
    normal_quantiles: FloatArray
    ordered: FloatArray


@dataclass(frozen=True, eq=False)
class Beginning:
    """The point estimate of an axis before any sampling: the model, how it was identified (None where it was
    given), where sampling would begin (None where that is not known yet), the order of its noise, the tests
    of its residuals, and the generators left."""

    model: HammersteinWiener
    identification: Identification | None
    estimate: Estimate | None
    noise_order: int
    residuals: ResidualReport
    infer_rng: np.random.Generator
    predict_rng: np.random.Generator


@dataclass(frozen=True, eq=False)
class Analysis:
    """Everything that a report on one axis says.

    `predictions` are those of the held-out records, or, where there are none, of the last training record
    (`held_out` False). `coverages` are pairs of record name and coverage. `autocorrelations`
    (parameters, lags) are averaged over the ensembles. `truth` holds true parameter values where they are
    known; `check` how often the intervals held on simulated axes like this one, where that was run.
    """

    title: str
    records: tuple[Record, ...]
    start: StartCondition
    identification: Identification | None
    inference: Inference
    predictions: tuple[Prediction, ...]
    held_out: bool
    fits: tuple[RecordFit, ...]
    coverages: tuple[tuple[str, Coverage], ...]
    response: ResponseBand
    spectrum: ResidualSpectrum
    autocorrelations: FloatArray
    truth: dict[str, float]
    check: OwnCheck | None = None


def analyse(
    title: str,
    records: Sequence[Record],
    holdout: Sequence[Record],
    rng: np.random.Generator,
    *,
    model: HammersteinWiener | None = None,
    start: StartCondition = "rest",
    noise: NoiseKind = "auto",
    settings: SamplerSettings | None = None,
    jobs: int = 1,
    progress: Progress | None = None,
    free: Sampled = "all",
    checkpoint_folder: Path | None = None,
    resume: bool = False,
    truth: dict[str, float] | None = None,
    beginning: Beginning | None = None,
) -> Analysis:
    """Identify (unless `model` is given), sample and predict; after `beginning`, which was made from the same
    arguments, where it is given.

    With `checkpoint_folder` the chains are kept there, and with `resume` they go on from what is there; the
    caller removes it with `discard_checkpoints`. Raises InputError when records and model differ in sample
    rate.
    """
    progress = progress or Progress(quiet=True)
    begun = beginning or begin(
        title, records, holdout, rng, model=model, start=start, noise=noise, free=free, progress=progress
    )
    identification, model = begun.identification, begun.model
    progress.say("posterior")
    inference = infer(
        model,
        records,
        begun.infer_rng,
        free=free,
        start=start,
        noise=noise,
        settings=settings,
        jobs=jobs,
        progress=progress,
        checkpoint_folder=checkpoint_folder,
        resume=resume,
        estimate=begun.estimate,
    )
    predicted = tuple(holdout) or (records[-1],)
    predictions = tuple(predict(inference.posterior, record, begun.predict_rng) for record in predicted)
    return Analysis(
        title=title,
        records=tuple(records),
        start=start,
        identification=identification,
        inference=inference,
        predictions=predictions,
        held_out=bool(holdout),
        fits=() if identification is None else tuple(evaluate(identification, holdout)),
        coverages=tuple(
            (prediction.record.name, band_coverage(prediction, level))
            for prediction in predictions
            for level in COVERAGE_LEVELS
        ),
        response=response_band(inference.posterior, identification),
        spectrum=residual_spectrum(inference.residuals, model.sample_rate_hz),
        autocorrelations=chain_autocorrelations(inference.posterior),
        truth=truth or {},
    )


def begin(
    title: str,
    records: Sequence[Record],
    holdout: Sequence[Record],
    rng: np.random.Generator,
    *,
    model: HammersteinWiener | None = None,
    start: StartCondition = "rest",
    noise: NoiseKind = "auto",
    free: Sampled = "all",
    progress: Progress | None = None,
) -> Beginning:
    """Identify (unless `model` is given) and test the residuals, before anything is sampled.

    Raises InputError when records and model differ in sample rate.
    """
    progress = progress or Progress(quiet=True)
    infer_rng, predict_rng = rng.spawn(2)
    identification = None
    if model is None:
        identification = identify_with_progress(records, title, start, progress)
        model = identification.model
    check_rates(model, [*records, *holdout])
    if identification is not None and start == "rest":
        errors = [
            with_holes(record.y - model.simulate(record.u, known=record.known).y, record.measured)
            for record in records
        ]
        found = estimate_noise(errors)
        residuals = examine_residuals(records, errors, found.autoregression)
        return Beginning(model, identification, None, len(found.partial), residuals, infer_rng, predict_rng)
    (start_rng,) = copy.deepcopy(infer_rng).spawn(1)
    estimate = estimated(model, records, start_rng, free=free, start=start, noise=noise, progress=progress)
    order = len(estimate.start.noise.partial)
    return Beginning(model, identification, estimate, order, estimate.residuals, infer_rng, predict_rng)


def discard_checkpoints(folder: Path) -> None:
    """Remove the checkpoint that `analyse` kept in `folder`."""
    discard_checkpoint(folder)


STEPS = 4
"""Of the identification, each of which reports how far it is."""


def identify_with_progress(
    records: Sequence[Record],
    name: str,
    start: StartCondition,
    progress: Progress,
) -> Identification:
    """The four-step estimate, its stages shown as one task that never goes back, with the known inputs of the
    records."""
    with progress.task("four-step identification, %", 100) as task:
        stages: list[str] = []

        def report(stage: str, done: int, total: int) -> None:
            if stage not in stages:
                stages.append(stage)
            whole = (stages.index(stage) + done / max(total, 1)) / max(STEPS, len(stages))
            task.reach(max(task.done, min(99, int(100 * whole))), stage)

        found = identify(records, name=name, free_start=start == "free", report=report)
        task.reach(100)
    return with_known(found, records)


def response_band(posterior: Posterior, identification: Identification | None) -> ResponseBand:
    """The frequency response of G under the posterior, up to half the sample rate."""
    rate = posterior.axis.model.sample_rate_hz
    frequency = np.geomspace(LOWEST_RESPONSE_SHARE * rate, 0.499 * rate, RESPONSE_POINTS)
    n_axis = len(posterior.axis.parameters)
    draws = posterior.draws(RESPONSE_DRAWS, np.random.default_rng(0))[:, :n_axis].T
    response = posterior.axis.frequency_response(draws, frequency)
    tail = (1 - INTERVAL_PROBABILITY) / 2
    magnitude = np.quantile(20 * np.log10(np.abs(response)), [tail, 1 - tail], axis=0)
    phase = np.quantile(np.rad2deg(np.unwrap(np.angle(response), axis=1)), [tail, 1 - tail], axis=0)
    baseline = None
    if identification is not None:
        baseline = identification.baseline.linear.frequency_response(frequency, rate)
    return ResponseBand(
        frequency,
        posterior.mean_model().linear.frequency_response(frequency, rate),
        baseline,
        (magnitude[0], magnitude[1]),
        (phase[0], phase[1]),
    )


def residual_spectrum(residuals: ResidualReport, sample_rate_hz: float) -> ResidualSpectrum:
    """Welch's periodogram of the innovations, zero where there are none, over the share of samples that have
    one; and their order statistics."""
    joined = np.concatenate(residuals.innovations)
    joined = joined[~np.isnan(joined)]
    length = min(256, min(len(part) for part in residuals.innovations))
    filled = [np.nan_to_num(part) for part in residuals.innovations]
    share = len(joined) / sum(map(len, filled))
    spectra = [signal.welch(part, sample_rate_hz, nperseg=length) for part in filled]
    frequency = spectra[0][0]
    density = np.mean([density for _, density in spectra], axis=0) / share
    ordered = np.sort(joined) / np.std(joined)
    levels = (np.arange(len(ordered)) + 0.5) / len(ordered)
    return ResidualSpectrum(
        frequency,
        density,
        2 * float(np.var(joined)) / sample_rate_hz,
        np.asarray(stats.norm.ppf(levels)),
        ordered,
    )


def chain_autocorrelations(posterior: Posterior) -> FloatArray:
    """Autocorrelation functions of every parameter's chains, (parameters, lags)."""
    steps = posterior.values.shape[1]
    lags = min(steps, AUTOCORRELATION_LAGS)
    return np.array(
        [
            np.mean([autocorrelation_function(chain)[:lags] for chain in posterior.chains(name)], axis=0)
            for name in posterior.names
        ]
    )
