"""bayes-hw report where the model's own residuals refute it: what is missing, and the axis with it."""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import numpy as np

from bayes_hw.analysis import Beginning
from bayes_hw.commands.drive import drive_of
from bayes_hw.commands.estimate_files import band_file_names, write_identification
from bayes_hw.commands.next_step import say_next
from bayes_hw.commands.speech import note, say_estimate, say_page
from bayes_hw.errors import InputError
from bayes_hw.files import staged, write_csv, write_json
from bayes_hw.gap.joint.answer.corrected_model import predict_corrected
from bayes_hw.gap.joint.corrected_posterior import corrected_posterior
from bayes_hw.gap.joint.fit.unreached_limits import standing_outermost
from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis, diagnose_records
from bayes_hw.held_out import HeldOut, held_out_of
from bayes_hw.posing import Posed
from bayes_hw.progress import Progress
from bayes_hw.provenance import provenance_of
from bayes_hw.report.diagnosis.joint_report import joint_report
from bayes_hw.report.page.render import render

CORRECTED_FILES = ["corrected.json", "verdict.json", "holdout_prediction.csv"]
"""What a folder holds where the model of the records was refuted and corrected."""

PLAIN_FILES = ["posterior.nc", "fit.json", "free_residual.csv"]
"""What it holds where it was not."""

LARGEST_PLAIN_ORDER = 1
"""Order of the noise up to which nothing is suspected of it."""

REFUTED = "refuted"
"""Folder of the estimate that does not hold."""


def suspicions(beginning: Beginning) -> tuple[str, ...]:
    """In words, why a model may lack something; empty where nothing says so.

    A failed test of the residuals, a poor fit, or a noise of more than the first order: an autoregression of
    high order takes up what the model lacks, after which the tests of its innovations pass.
    """
    residuals = beginning.residuals
    found = [f"{test.name}: {test.meaning}" for test in residuals.tests if not test.passed]
    if not residuals.explained:
        found.append(f"it explains little of the records (fit {residuals.fit_percent:.0f} %)")
    order = beginning.noise_order
    if order > LARGEST_PLAIN_ORDER:
        found.append(f"its noise needs an autoregression of order {order}, which may hold what it lacks")
    return tuple(found)


def report_cause(
    parsed: argparse.Namespace, title: str, given: Posed, beginning: Beginning, progress: Progress
) -> bool:
    """Search for what the model lacks, and report it; False where nothing is found, or records that begin in
    motion come to rest too late for the search to start there."""
    for suspicion in suspicions(beginning):
        progress.say(f"the plain model is doubted: {suspicion}")
    try:
        chosen = held_out_of(given.records, given.holdout, parsed.start, parsed.origin)
    except InputError as error:
        note(f"the plain model is doubted, and what is missing cannot be sought: {error}")
        return False
    for sentence in chosen.notes:
        note(sentence)
    diagnosis = diagnose_records(
        chosen.train,
        chosen.holdout,
        np.random.default_rng(parsed.seed),
        name=title,
        notes=chosen.notes,
        progress=progress,
        lead=chosen.lead,
        drive=drive_of(parsed),
        start=parsed.start,
        jobs=parsed.jobs,
        within_s=parsed.within,
    )
    if not diagnosis.verdict.answer:
        return False
    out = Path(parsed.out)
    with progress.stage("report"):
        write_cause(out, diagnosis, beginning, chosen)
        records = [*given.records, *given.holdout]
        page = joint_report(diagnosis, provenance_of(parsed, records), beginning)
        written = render(page, out)
    say_corrected(diagnosis)
    say_page(page, written)
    say_next(parsed, "design", "--posterior", str(out), "--out", "design/")
    return True


def write_cause(out: Path, diagnosis: JointDiagnosis, beginning: Beginning, chosen: HeldOut) -> None:
    """verdict.json, corrected.json (model.json is the same), posterior.json of the corrected model, bands of
    what was held out; the model that does not hold goes into a folder of that name. All or none."""
    names = band_file_names([record.name for record in chosen.holdout])
    with staged(out, instead_of=PLAIN_FILES) as place:
        diagnosis.write(place)
        shutil.copyfile(place / "corrected.json", place / "model.json")
        write_json(place / "posterior.json", corrected_posterior(diagnosis))
        for name, record in zip(names, chosen.holdout, strict=True):
            mean, low, high = predict_corrected(diagnosis.corrected, record.u, record.known)
            bands = {"mean": mean, "lo": low, "hi": high}
            columns = record.columns() | {n: band + record.origin for n, band in bands.items()}
            write_csv(place / name, {n: values[chosen.lead :] for n, values in columns.items()})
        if beginning.identification is not None:
            write_identification(place / REFUTED, beginning.identification, (), chosen.train)


def say_corrected(diagnosis: JointDiagnosis) -> None:
    """One line a parameter of the corrected model on stdout."""
    beyond = standing_outermost(diagnosis.posterior.fit)
    for name, e in {**diagnosis.verdict.parameters, **diagnosis.verdict.base}.items():
        say_estimate(name, e.mean, e.sd, e.hdi94, e.unit, unreached=name in beyond)
