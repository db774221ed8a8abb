"""The commands on one axis that estimate or predict: identify, sample, predict, report."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.analysis import Analysis, analyse, discard_checkpoints, identify_with_progress
from bayes_hw.analysis import begin as begin_analysis
from bayes_hw.commands.checking import checked, say_check, structure_in, write_check, write_structure
from bayes_hw.commands.corrected import warn_of_refuted
from bayes_hw.commands.estimate_files import band_file_names, write_identification
from bayes_hw.commands.inputs import add_known_inputs, sampler_settings
from bayes_hw.commands.next_step import diagnose_next, reading_options, say_next
from bayes_hw.commands.records import axis_name, in_asked_units, records_of
from bayes_hw.commands.report_cause import CORRECTED_FILES, report_cause, suspicions
from bayes_hw.commands.speech import say, say_estimate, say_page, warn
from bayes_hw.files import check_output_file, check_output_folder, staged, write_csv
from bayes_hw.gap.any_corrected import corrected_file
from bayes_hw.gap.joint.answer.corrected_model import predict_corrected, read_corrected
from bayes_hw.identify.validation import evaluate
from bayes_hw.infer.inference import discard_checkpoint, infer, said_of
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.prediction import Prediction, band_holds, coverage_sentence, predict
from bayes_hw.infer.start_state import start_of_prediction, started_as
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.progress import Progress
from bayes_hw.provenance import provenance_of
from bayes_hw.report.page.render import render
from bayes_hw.report.posterior.posterior_report import posterior_report


def identify_command(parsed: argparse.Namespace) -> None:
    """bayes-hw identify."""
    check_output_folder(Path(parsed.out))
    given = records_of(parsed, parsed.records, parsed.holdout)
    records, holdout = given.records, given.holdout
    identification = identify_with_progress(
        records,
        axis_name(parsed.records),
        given.start,
        Progress(parsed.quiet),
    )
    fits = evaluate(identification, holdout)
    write_identification(Path(parsed.out), identification, fits, records)
    for warning in identification.warnings:
        warn(warning)
    for step in identification.steps:
        say(f"{step.name:32} rms error {step.cost:.4g}, fit {step.fit_percent:.2f} %")
    if known := ", ".join(one.column for one in identification.model.known):
        shares = ", ".join(f"{fit.hammerstein_wiener:.2f} %" for fit in identification.fits)
        say(f"{'with ' + known:32} fit {shares}")
    for fit in fits:
        say(f"{fit.record}: Hammerstein-Wiener {fit.hammerstein_wiener:.2f} %, linear {fit.linear:.2f} %")
    model = Path(parsed.out) / "model.json"
    say(f"model: {model}")
    again = reading_options(parsed)
    say_next(parsed, "sample", "--model", str(model), *parsed.records, *again, "--out", "posterior/")


def report_command(parsed: argparse.Namespace) -> None:
    """bayes-hw report."""
    settings = sampler_settings(parsed)
    out = Path(parsed.out)
    check_output_folder(out)
    model = HammersteinWiener.read(parsed.model) if parsed.model else None
    if model is not None:
        add_known_inputs(parsed, model)
    given = records_of(parsed, parsed.records, parsed.holdout, model)
    records, holdout = given.records, given.holdout
    progress = Progress(parsed.quiet)
    say_whether_resumed(parsed)
    title = parsed.title or out.resolve().name or records[0].name
    rng = np.random.default_rng(parsed.seed)
    beginning = begin_analysis(
        title, records, holdout, rng, model=model, start=given.start, noise=parsed.noise, progress=progress
    )
    if suspicions(beginning) and report_cause(parsed, title, given, beginning, progress):
        return
    analysis = analyse(
        title,
        records,
        holdout,
        rng,
        model=model,
        start=given.start,
        noise=parsed.noise,
        settings=settings,
        jobs=parsed.jobs,
        progress=progress,
        checkpoint_folder=parsed.checkpoint,
        resume=parsed.resume,
        beginning=beginning,
    )
    if parsed.check > 0:
        check = checked(parsed, out, analysis.inference.posterior, records, settings)
        analysis = replace(analysis, check=check)
    with progress.stage("report"):
        write_analysis(out, analysis)
        origin = provenance_of(parsed, [*records, *holdout])
        page = posterior_report(analysis, origin)
        written = render(page, out)
    discard_checkpoints(parsed.checkpoint)
    say_estimates(analysis.inference.posterior)
    if analysis.check is not None:
        say_check(analysis.check)
    say_page(page, written)
    following = ["design", "--posterior", str(out), "--out", "design/"]
    if not analysis.inference.residuals.white:
        source = parsed.model or str(out / "model.json")
        following = diagnose_next(source, parsed.records, parsed.holdout) or following
    say_next(parsed, *following, *(reading_options(parsed) if following[0] == "diagnose" else []))


def write_analysis(out: Path, analysis: Analysis) -> None:
    """The files of identify, sample and predict in one folder, all or none."""
    names = band_file_names([prediction.record.name for prediction in analysis.predictions])
    with staged(out, instead_of=CORRECTED_FILES) as place:
        if analysis.identification is not None:
            write_identification(place, analysis.identification, analysis.fits, analysis.records)
        analysis.inference.posterior.write(place, analysis.records)
        if analysis.identification is not None:
            write_structure(place, analysis.identification.pool.to_dict())
        if analysis.check is not None:
            write_check(place, analysis.check)
        for name, prediction in zip(names, analysis.predictions, strict=True):
            write_prediction(place / name, prediction)


def sample_command(parsed: argparse.Namespace) -> None:
    """bayes-hw sample."""
    settings = sampler_settings(parsed)
    out = Path(parsed.out)
    check_output_folder(out)
    model = HammersteinWiener.read(parsed.model)
    add_known_inputs(parsed, model)
    given = records_of(parsed, parsed.records, model=model)
    records = given.records
    say_whether_resumed(parsed)
    inference = infer(
        model,
        records,
        np.random.default_rng(parsed.seed),
        free=parsed.free,
        start=given.start,
        noise=parsed.noise,
        settings=settings,
        jobs=parsed.jobs,
        progress=Progress(parsed.quiet),
        checkpoint_folder=parsed.checkpoint,
        resume=parsed.resume,
    )
    inference.posterior.write(out, records)
    write_structure(out, structure_in(Path(parsed.model)))
    discard_checkpoint(parsed.checkpoint)
    say_estimates(inference.posterior)
    if parsed.check > 0:
        check = checked(parsed, out, inference.posterior, records, settings)
        write_check(out, check)
        say_check(check)
    for doubt in said_of(inference)[not inference.posterior.converged :]:
        warn(doubt)
    following = ["design", "--posterior", parsed.out, "--out", "design/"]
    if not inference.residuals.white:
        following = diagnose_next(parsed.model, parsed.records, []) or following
    say_next(parsed, *following, *(reading_options(parsed) if following[0] == "diagnose" else []))


def predict_command(parsed: argparse.Namespace) -> None:
    """bayes-hw predict."""
    out = Path(parsed.out)
    place = Path(parsed.posterior)
    kept = [place / name for name in ("posterior.nc", "posterior.json", "corrected.json")]
    check_output_file(out, [Path(parsed.record), place, *kept], ".csv")
    path = corrected_file(place)
    corrected = None if path is None else read_corrected(path)
    if corrected is not None:
        _predict_corrected(parsed, out, corrected)
        return
    posterior = Posterior.read(parsed.posterior)
    add_known_inputs(parsed, posterior.axis.model)
    given = records_of(parsed, [parsed.record], model=posterior.axis.model, needs_output=False)
    (record,) = given.records
    started = started_as(posterior, start_of_prediction(parsed.start, given.start))
    prediction = predict(started, record, np.random.default_rng(parsed.seed))
    write_csv(out, in_asked_units(parsed, prediction.columns(), record.units))
    if not posterior.converged:
        warn(f"the posterior has not converged: {'; '.join(posterior.problems)}")
    warn_of_refuted(posterior)
    if record.has_output:
        say(coverage_sentence(record, prediction.mean, band_holds(prediction)))
    say_next(parsed, "design", "--posterior", parsed.posterior, "--out", "design/")


def _predict_corrected(parsed: argparse.Namespace, out: Path, corrected: Mapping[str, Any]) -> None:
    """Predict from the corrected model of a diagnosis."""
    model = HammersteinWiener.from_dict(corrected)
    add_known_inputs(parsed, model)
    (record,) = records_of(parsed, [parsed.record], model=model, needs_output=False).records
    mean, low, high = predict_corrected(corrected, record.u, record.known, record.level_sd)
    columns = {name: values for name, values in record.columns().items() if name not in record.known}
    bands = {"mean": mean, "lo": low, "hi": high}
    columns |= {name: band + record.origin for name, band in bands.items()}
    write_csv(out, in_asked_units(parsed, columns, record.units))
    if record.has_output:
        inside = (np.abs(record.y - mean) <= (high - low) / 2)[record.measured_samples]
        say(coverage_sentence(record, mean, inside.astype(np.float64)))
    say_next(parsed, "design", "--posterior", parsed.posterior, "--out", "design/")


def write_prediction(path: Path, prediction: Prediction) -> None:
    """The bands of one record as CSV."""
    write_csv(path, prediction.columns())


def say_estimates(posterior: Posterior) -> None:
    """One line a parameter on stdout, of the noise its size alone, and what has not converged on stderr."""
    if not posterior.converged:
        warn("NOT CONVERGED: " + "; ".join(posterior.problems))
    for name, summary in posterior.reported.items():
        if name.startswith("noise.") and name != "noise.sigma":
            continue
        beyond = name in posterior.unreached
        say_estimate(name, summary.mean, summary.sd, summary.hdi94, summary.unit, unreached=beyond)
    if posterior.trade is not None:
        say(posterior.trade.sentence)


def say_whether_resumed(parsed: argparse.Namespace) -> None:
    """A warning where --resume finds nothing to go on from."""
    if parsed.resume and not any(parsed.checkpoint.rglob("plan.h5")):
        warn(f"--resume: no checkpoint in {parsed.checkpoint}; started from the beginning")


COMMANDS: Mapping[str, Callable[[argparse.Namespace], None]] = {
    "identify": identify_command,
    "sample": sample_command,
    "predict": predict_command,
    "report": report_command,
}
