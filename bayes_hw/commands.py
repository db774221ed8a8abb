"""What each command of the command line does."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from bayes_hw.analysis import Analysis, analyse, identify_with_progress
from bayes_hw.csv_output import write_csv
from bayes_hw.errors import InputError
from bayes_hw.files import write_text_atomically
from bayes_hw.identify.result import Identification, RecordFit
from bayes_hw.identify.validation import evaluate
from bayes_hw.infer.inference import check_rates, discard_checkpoint, infer
from bayes_hw.infer.posterior import Posterior
from bayes_hw.infer.prediction import Prediction, band_coverage, predict
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.progress import Progress
from bayes_hw.provenance import provenance
from bayes_hw.record import Columns, Record, Units
from bayes_hw.report.posterior_report import posterior_report
from bayes_hw.report.render import render

CHECKPOINT_FOLDER = "checkpoint"


def check_common(parsed: argparse.Namespace) -> None:
    """Raise InputError on option values that no command can use."""
    if parsed.jobs < 1:
        raise InputError(f"--jobs {parsed.jobs}: must be one or more")
    if parsed.seed < 0:
        raise InputError(f"--seed {parsed.seed}: must be zero or more")


def interruption_advice(parsed: argparse.Namespace) -> str:
    """What to do after Ctrl-C."""
    folder = Path(parsed.out) / CHECKPOINT_FOLDER
    if parsed.command == "sample" and folder.is_dir():
        return f"the finished steps are in {folder}; the same command with --resume goes on"
    return "nothing was written; run the command again"


def read_records(
    parsed: argparse.Namespace, paths: Sequence[str], units: Units | None = None
) -> list[Record]:
    """The records at `paths` as the options say; `units` are the model's, where there is one."""
    base = units or Units()
    chosen = replace(base, input=parsed.input_unit or base.input, output=parsed.output_unit or base.output)
    columns = Columns(
        time=None if parsed.time == "none" else parsed.time, input=parsed.input, output=parsed.output
    )
    return [
        Record.read(
            path,
            columns=columns,
            sample_rate_hz=parsed.sample_rate,
            resample_hz=parsed.resample,
            units=chosen,
        )
        for path in paths
    ]


def sampler_settings(parsed: argparse.Namespace) -> SamplerSettings:
    """The sampler's settings from the options, checked."""
    if parsed.ensembles < 4:
        raise InputError(f"--ensembles {parsed.ensembles}: convergence needs four or more")
    if parsed.walkers is not None and (parsed.walkers < 16 or parsed.walkers % 2):
        raise InputError(f"--walkers {parsed.walkers}: must be even, 16 or more")
    if parsed.max_steps < 50:
        raise InputError(f"--max-steps {parsed.max_steps}: must be 50 or more")
    if not parsed.target_ess > 0:
        raise InputError(f"--target-ess {parsed.target_ess:g}: must be positive")
    return SamplerSettings(
        ensembles=parsed.ensembles,
        walkers=parsed.walkers,
        max_steps=parsed.max_steps,
        target_ess=parsed.target_ess,
    )


def identify_command(parsed: argparse.Namespace) -> int:
    """bayes-hw identify."""
    records = read_records(parsed, parsed.records)
    holdout = read_records(parsed, parsed.holdout)
    identification = identify_with_progress(
        records,
        np.random.default_rng(parsed.seed),
        records[0].name,
        parsed.start,
        Progress(parsed.quiet),
    )
    fits = evaluate(identification, holdout)
    write_identification(Path(parsed.out), identification, fits)
    for block in identification.blocks_shown.values():
        if not block.shown:
            warn(block.reason)
    for warning in identification.warnings:
        warn(warning)
    if not parsed.quiet:
        for step in identification.steps:
            print(f"{step.name:32} rms error {step.cost:.4g}, fit {step.fit_percent:.2f} %")
        for fit in fits:
            print(
                f"{fit.record}: Hammerstein-Wiener {fit.hammerstein_wiener:.2f} %, linear {fit.linear:.2f} %"
            )
    return 0


def report_command(parsed: argparse.Namespace) -> int:
    """bayes-hw report."""
    begin = time.perf_counter()
    settings = sampler_settings(parsed)
    model = HammersteinWiener.read(parsed.model) if parsed.model else None
    units = model.units if model is not None else None
    records = read_records(parsed, parsed.records, units)
    holdout = read_records(parsed, parsed.holdout, units)
    out = Path(parsed.out)
    progress = Progress(parsed.quiet)
    analysis = analyse(
        parsed.title or records[0].name,
        records,
        holdout,
        np.random.default_rng(parsed.seed),
        model=model,
        start=parsed.start,
        settings=settings,
        jobs=parsed.jobs,
        progress=progress,
    )
    with progress.stage("report"):
        write_analysis(out, analysis)
        origin = provenance(
            parsed.command_line, parsed.seed, [*records, *holdout], time.perf_counter() - begin
        )
        written = render(posterior_report(analysis, origin), out)
    say_verdict(analysis.dominant.posterior, parsed.quiet)
    if not parsed.quiet:
        print(f"report: {written.html} and {written.pdf}")
    return 0


def write_analysis(out: Path, analysis: Analysis) -> None:
    """The files of identify, sample and predict in one folder."""
    if analysis.identification is not None:
        write_identification(out, analysis.identification, analysis.fits)
    analysis.dominant.posterior.write(out, analysis.records)
    for prediction in analysis.predictions:
        write_prediction(out / f"bands_{prediction.record.name}.csv", prediction)


def write_identification(out: Path, identification: Identification, validation: Sequence[RecordFit]) -> None:
    """model.json and fit.json."""
    content = identification.to_dict() | {"validation": [asdict(fit) for fit in validation]}
    identification.model.write(out / "model.json")
    write_text_atomically(out / "fit.json", json.dumps(content, indent=1, allow_nan=False) + "\n")


def sample_command(parsed: argparse.Namespace) -> int:
    """bayes-hw sample."""
    settings = sampler_settings(parsed)
    model = HammersteinWiener.read(parsed.model)
    records = read_records(parsed, parsed.records, model.units)
    out = Path(parsed.out)
    inference = infer(
        model,
        records,
        np.random.default_rng(parsed.seed),
        free=parsed.free,
        start=parsed.start,
        settings=settings,
        jobs=parsed.jobs,
        progress=Progress(parsed.quiet),
        checkpoint_folder=out / CHECKPOINT_FOLDER,
        resume=parsed.resume,
    )
    inference.posterior.write(out, records)
    discard_checkpoint(out / CHECKPOINT_FOLDER)
    say_verdict(inference.posterior, parsed.quiet)
    if not inference.residuals.white:
        failed = [test for test in inference.residuals.tests if not test.passed]
        warn(f"the residuals are not white: {failed[0].name}: {failed[0].meaning}")
    return 0


def simulate_command(parsed: argparse.Namespace) -> int:
    """bayes-hw simulate."""
    model = HammersteinWiener.read(parsed.model)
    (record,) = read_records(parsed, [parsed.record], model.units)
    check_rates(model, [record])
    simulation = model.simulate(record.u)
    write_csv(
        Path(parsed.out),
        {"t": record.t, "u": record.u, "y": record.y, "w": simulation.w, "y_model": simulation.y},
    )
    return 0


def predict_command(parsed: argparse.Namespace) -> int:
    """bayes-hw predict."""
    posterior = Posterior.read(parsed.posterior)
    (record,) = read_records(parsed, [parsed.record], posterior.axis.model.units)
    prediction = predict(posterior, record, np.random.default_rng(parsed.seed))
    write_prediction(Path(parsed.out), prediction)
    if not posterior.converged:
        warn(f"the posterior has not converged: {posterior.problems[0]}")
    if not parsed.quiet:
        achieved = band_coverage(prediction)
        low, high = achieved.interval
        print(
            f"fit {prediction.fit_percent:.1f} %; 94 % bands hold {100 * achieved.achieved:.1f} % of the"
            f" samples (95 % interval {100 * low:.1f} to {100 * high:.1f} %)"
        )
    return 0


def write_prediction(path: Path, prediction: Prediction) -> None:
    """The bands of one record as CSV."""
    record = prediction.record
    write_csv(
        path,
        {
            "t": record.t,
            "u": record.u,
            "y": record.y,
            "mean": prediction.mean,
            "lo": prediction.lower,
            "hi": prediction.upper,
            "lo_parameters": prediction.lower_parameters,
            "hi_parameters": prediction.upper_parameters,
        },
    )


def say_verdict(posterior: Posterior, quiet: bool) -> None:
    """One line a parameter on stdout, and what has not converged on stderr."""
    if not posterior.converged:
        warn("NOT CONVERGED: " + "; ".join(posterior.problems))
    if quiet:
        return
    for name, summary in posterior.summaries.items():
        low, high = summary.hdi94
        unit = f" {summary.unit}" if summary.unit else ""
        print(f"{name:32} {summary.mean:.6g} +- {summary.sd:.2g}{unit}, 94 % HDI [{low:.6g}, {high:.6g}]")


def warn(message: str) -> None:
    """One line on stderr."""
    print(f"bayes-hw: warning: {' '.join(message.split())}", file=sys.stderr)
