"""bayes-hw diagnose: where the simulation departs from the records, which effect, how far it shrinks."""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

from bayes_hw.commands.next_step import reading_options, say_next
from bayes_hw.commands.options import add_common, add_output, add_record_options, add_start
from bayes_hw.errors import InputError

NAME = "diagnose"
SUMMARY = "why a simulator and records differ: where, which unmodelled effect, how far the gap shrinks"
EXAMPLE = "bayes-hw diagnose case/ --out diagnosis/"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A case folder, or a model with records to train on and records held out."""
    parser.add_argument("case", nargs="?", metavar="CASE", help="folder with case.json")
    parser.add_argument("--model", metavar="MODEL.json", help="the simulator, instead of a case folder")
    parser.add_argument(
        "--simulator",
        metavar="MODULE:FUNCTION",
        help="a simulator of your own instead: a function that returns a bayes_hw.gap.simulator.Simulator",
    )
    parser.add_argument("--train", nargs="+", default=[], metavar="RECORD", help="records to diagnose")
    parser.add_argument(
        "--holdout", nargs="+", default=[], metavar="RECORD", help="records to score on, never fitted"
    )
    parser.add_argument(
        "--without",
        nargs="+",
        default=[],
        metavar="LABEL",
        help="labels to strike from the catalogue of effects",
    )
    parser.add_argument("--no-report", action="store_true", help="leave out report.html and report.pdf")
    add_output(
        parser,
        "folder for verdict.json, holdout_prediction.csv, report.html, report.pdf; where the answer is other,"
        " free_residual.csv too: the missing force over time (default: NAME_diagnosis, NAME that of the "
        "case)",
        required=False,
    )
    parser.set_defaults(default_out=default_out)
    add_record_options(parser)
    add_start(parser)
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Diagnose and write; raises InputError on bad input before anything is written."""
    import numpy as np

    from bayes_hw.commands import inputs
    from bayes_hw.commands.speech import note, say, say_page
    from bayes_hw.files import check_output_folder
    from bayes_hw.gap.case import Case
    from bayes_hw.gap.diagnosis import diagnose, write_results
    from bayes_hw.gap.effects.any_simulator import FOR_ANY_SIMULATOR
    from bayes_hw.gap.effects.catalogue import LABEL_BLOCKS, known_labels
    from bayes_hw.gap.posed_case import posed_case
    from bayes_hw.gap.sentence import sentence
    from bayes_hw.gap.simulator_case import SimulatorCase, find_simulator
    from bayes_hw.progress import Progress
    from bayes_hw.record import Record, Units
    from bayes_hw.report.render import remove_pages, render

    begin = time.perf_counter()
    out = Path(parsed.out)
    known = known_labels()
    if parsed.simulator is not None:
        known = [*LABEL_BLOCKS, *sorted({kind.label for kind in FOR_ANY_SIMULATOR} - set(LABEL_BLOCKS))]
    if unknown := [label for label in parsed.without if label not in known]:
        raise InputError(f"--without {unknown[0]}: not in the catalogue; use one of {', '.join(known)}")
    if sum(given is not None for given in (parsed.case, parsed.model, parsed.simulator)) != 1:
        raise InputError(
            "give either a case folder or --model or --simulator, these with --train and --holdout"
        )
    if parsed.case is not None and (parsed.train or parsed.holdout):
        raise InputError("--train and --holdout go with --model or --simulator, not with a case folder")
    check_output_folder(out)
    train, holdout = [Path(p) for p in parsed.train], [Path(p) for p in parsed.holdout]

    def read_record(path: Path, *, units: Units) -> Record:
        return inputs.read_record(parsed, str(path), units)

    case: Case | SimulatorCase
    if parsed.case is not None:
        case = Case.read(Path(parsed.case), read_record)
    elif parsed.simulator is not None:
        case = SimulatorCase.of_files(find_simulator(parsed.simulator), train, holdout, read_record)
    else:
        case = Case.of_files(Path(parsed.model).stem, Path(parsed.model), train, holdout, read_record)
    case, notes = posed_case(
        case, origin=parsed.origin, start=parsed.start, accepted=parsed.accept, looked_at=True
    )
    for done in notes:
        note(done)
    progress = Progress(parsed.quiet)
    diagnosis = diagnose(
        case,
        np.random.default_rng(parsed.seed),
        jobs=parsed.jobs,
        without=frozenset(parsed.without),
        progress=progress,
    )
    write_results(diagnosis, out)
    remove_pages(out)
    if not parsed.no_report:
        from bayes_hw.provenance import provenance
        from bayes_hw.report.diagnosis_report import diagnosis_report

        with progress.stage("report"):
            records = [*case.train, *case.holdout]
            origin = provenance(parsed.command_line, parsed.seed, records, time.perf_counter() - begin)
            page = diagnosis_report(diagnosis, origin)
            written = render(page, out)
    if parsed.no_report:
        say(sentence(diagnosis))
        say(f"verdict: {out / 'verdict.json'}")
    else:
        say_page(page, written)
    say_next(parsed, *_next(parsed, out, diagnosis.verdict.answer))


def _next(parsed: argparse.Namespace, out: Path, answer: Sequence[str]) -> list[str]:
    """With a simulator that holds: sample it; with one that is corrected: simulate that; else try to do
    without the answer."""
    again = reading_options(parsed)
    folder = Path(parsed.case) if parsed.case is not None else None
    if not answer and parsed.model is not None:
        return ["sample", "--model", parsed.model, *parsed.train, *again, "--out", "posterior/"]
    corrected = out / "corrected.json"
    if answer and corrected.exists():
        record = parsed.holdout[0] if folder is None else str(folder / "holdout.csv")
        return ["simulate", "--model", str(corrected), record, *again, "--out", "repaired.csv"]
    if folder is not None:
        given = [parsed.case]
    else:
        source = ["--model", parsed.model] if parsed.model is not None else ["--simulator", parsed.simulator]
        given = [*source, "--train", *parsed.train, "--holdout", *parsed.holdout]
    named = [label for label in answer if label != "other"]
    without = (
        ["--without", *parsed.without, *named]
        if named or parsed.without
        else ["--seed", str(parsed.seed + 1)]
    )
    return ["diagnose", *given, *without, *again, "--out", f"{out}_again"]


def default_out(parsed: argparse.Namespace) -> str:
    """NAME_diagnosis in the working folder, NAME that of the case folder, the model or the simulator."""
    if parsed.case is not None:
        name = Path(parsed.case).resolve().name
    else:
        name = Path(parsed.model).stem if parsed.model else (parsed.simulator or "").partition(":")[0]
    return f"{name}_diagnosis" if name else "diagnosis"
