"""bayes-hw diagnose: where the simulation departs from the records, which effect, how far it shrinks."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from bayes_hw.commands.drive import drive_of
from bayes_hw.commands.next_step import reading_options, say_next
from bayes_hw.commands.options import (
    add_common,
    add_drive,
    add_output,
    add_record_options,
    add_start,
    add_within,
)
from bayes_hw.errors import InputError

if TYPE_CHECKING:
    import numpy as np

    from bayes_hw.gap.case.case import ReadRecord
    from bayes_hw.gap.diagnosis import Diagnosis
    from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis
    from bayes_hw.progress import Progress
    from bayes_hw.provenance import Provenance
    from bayes_hw.record import Record
    from bayes_hw.report.page.document import Report
    from bayes_hw.simulators.simulator_file import SimulatorFile

NAME = "diagnose"
SUMMARY = "why a simulator and records differ: where, which unmodelled effect, how far the gap shrinks"
DECLARATION_OF_A_FILE = "--declaration goes with --simulator FILE, a MuJoCo model or an FMU"
EXAMPLE = (
    "bayes-hw diagnose case/ --out diagnosis/\n"
    "  bayes-hw diagnose a.csv b.csv c.csv --out diagnosis/\n"
    "  bayes-hw diagnose --simulator axis.xml --train a.csv b.csv --holdout c.csv --out diagnosis/"
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A case folder, or a model with records to train on and records held out."""
    parser.add_argument(
        "case",
        nargs="*",
        metavar="CASE|RECORD",
        help="folder with case.json; or records to diagnose without any model",
    )
    parser.add_argument("--model", metavar="MODEL.json", help="the simulator, instead of a case folder")
    parser.add_argument(
        "--simulator",
        metavar="FILE|MODULE:FUNCTION",
        help="a simulator of your own instead: a MuJoCo model (axis.xml, MJCF or URDF) or an FMU (axis.fmu), "
        "which come back corrected; or a function that returns a bayes_hw.gap.case.simulator.Simulator",
    )
    parser.add_argument(
        "--declaration",
        metavar="FILE.toml",
        help="what a simulator's file does not say: which actuator takes the command, which joint is "
        "measured, units, uncertain parameters, where forces may enter (default: beside the simulator, its "
        "name with .toml)",
    )
    parser.add_argument("--train", nargs="+", default=[], metavar="RECORD", help="records to diagnose")
    parser.add_argument(
        "--holdout",
        nargs="+",
        default=[],
        metavar="RECORD",
        help="records to score on, never fitted (default without a model: the last one or its end)",
    )
    parser.add_argument(
        "--without",
        nargs="+",
        default=[],
        metavar="LABEL",
        help="labels to leave out of the catalogue of effects",
    )
    parser.add_argument("--title", default="", help="title of the report (default: the axis's name)")
    parser.add_argument("--no-report", action="store_true", help="leave out report.html and report.pdf")
    add_output(
        parser,
        "folder for verdict.json, holdout_prediction.csv, report.html, report.pdf; where the answer is other,"
        " free_residual.csv too: the missing force over time (default: NAME_diagnosis, NAME that of the "
        "case)",
        required=False,
    )
    parser.set_defaults(default_out=default_out, simulates_records=True)
    add_record_options(parser)
    add_within(parser)
    add_start(parser)
    add_drive(parser)
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Diagnose and write; raises InputError on bad input before anything is written."""
    from bayes_hw.commands.inputs import case_folder
    from bayes_hw.files import check_output_folder
    from bayes_hw.gap.effects.any_simulator import FOR_ANY_SIMULATOR
    from bayes_hw.gap.effects.catalogue import known_labels
    from bayes_hw.gap.effects.labels import LABEL_BLOCKS

    out = Path(parsed.out)
    drive_of(parsed)
    known = known_labels()
    if parsed.simulator is not None:
        known = [*LABEL_BLOCKS, *sorted({kind.label for kind in FOR_ANY_SIMULATOR} - set(LABEL_BLOCKS))]
    if unknown := [label for label in parsed.without if label not in known]:
        raise InputError(f"--without {unknown[0]}: not in the catalogue; use one of {', '.join(known)}")
    folder = case_folder(parsed)
    if folder is None and parsed.case and parsed.model is None and parsed.simulator is None:
        _from_records(parsed, out)
        return
    if (bool(parsed.case) + (parsed.model is not None) + (parsed.simulator is not None)) != 1:
        raise InputError(
            "give either a case folder or --model or --simulator, these with --train and --holdout; "
            "or records alone"
        )
    if parsed.case and (parsed.train or parsed.holdout):
        raise InputError("--train and --holdout go with --model or --simulator, not with a case folder")
    check_output_folder(out)
    if parsed.simulator is not None:
        _from_simulator(parsed, out)
    elif parsed.declaration is not None:
        raise InputError(DECLARATION_OF_A_FILE)
    else:
        _from_model(parsed, out, folder)


def _reader(parsed: argparse.Namespace) -> ReadRecord:
    """Reads one record as the options say."""
    from bayes_hw.commands import inputs

    return lambda path, *, units: inputs.read_record(parsed, str(path), units)


def _from_model(parsed: argparse.Namespace, out: Path, folder: str | None) -> None:
    """Diagnose a model.json, or a case folder's; one of the very records is opened again."""
    import numpy as np

    from bayes_hw.commands.speech import note
    from bayes_hw.gap.any_train import diagnose_around
    from bayes_hw.gap.case.case import Case
    from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis
    from bayes_hw.progress import Progress

    train, holdout = ([Path(p) for p in given] for given in (parsed.train, parsed.holdout))
    if folder is not None:
        case = Case.read(Path(folder), _reader(parsed))
    else:
        case = Case.of_files(Path(parsed.model).stem, Path(parsed.model), train, holdout, _reader(parsed))
    case, notes = case.posed(origin=parsed.origin, start=parsed.start, accepted=parsed.accept, looked_at=True)
    if parsed.title:
        case = replace(case, name=parsed.title)
    for done in notes:
        note(done)
    if _own_model(parsed.model or folder or "", case.train):
        from bayes_hw.gap.joint.joint_diagnosis import OWN_MODEL

        _joint(parsed, out, case.train, case.holdout, case.name, (OWN_MODEL,))
        return
    _warn_of_unused(parsed, ())
    progress = Progress(parsed.quiet)
    rng = np.random.default_rng(parsed.seed)
    found = diagnose_around(
        case,
        rng,
        jobs=parsed.jobs,
        without=frozenset(parsed.without),
        progress=progress,
        start=parsed.start,
        drive=drive_of(parsed),
        within_s=parsed.within,
    )
    if isinstance(found, JointDiagnosis):
        _write_joint(parsed, out, found, [*case.train, *case.holdout], progress)
    else:
        _write(parsed, out, found, progress, rng)


def _from_simulator(parsed: argparse.Namespace, out: Path) -> None:
    """Diagnose a simulator of the user's: a file, which comes back corrected, or a function."""
    import numpy as np

    from bayes_hw.commands.inputs import add_columns
    from bayes_hw.commands.speech import note
    from bayes_hw.gap.case.simulator import known_inputs
    from bayes_hw.gap.case.simulator_case import SimulatorCase, find_simulator
    from bayes_hw.gap.diagnosis import diagnose
    from bayes_hw.progress import Progress
    from bayes_hw.simulators.simulator_diagnosis import (
        full_simulator,
        is_simulator_file,
        open_simulator,
        simulator_case,
    )

    train, holdout = ([Path(p) for p in given] for given in (parsed.train, parsed.holdout))
    read, axis = _reader(parsed), None
    from_file = is_simulator_file(parsed.simulator)
    if parsed.declaration is not None and not from_file:
        raise InputError(DECLARATION_OF_A_FILE)
    if from_file:
        declaration = None if parsed.declaration is None else Path(parsed.declaration)
        axis = open_simulator(Path(parsed.simulator), declaration, parsed.jobs)
        add_columns(parsed, known_inputs(axis))
        own, held_out = ([read(path, units=axis.units) for path in paths] for paths in (train, holdout))
        asked = {"origin": parsed.origin, "start": parsed.start, "accepted": parsed.accept}
        case, notes = simulator_case(axis, own, held_out, **asked)
        for done in notes:
            note(done)
    else:
        simulator = find_simulator(parsed.simulator)
        add_columns(parsed, known_inputs(simulator))
        case = SimulatorCase.of_files(simulator, train, holdout, read)
    if parsed.title:
        case = replace(case, name=parsed.title)
    _warn_of_unused(parsed, known_inputs(case.model))
    progress = Progress(parsed.quiet)
    rng = np.random.default_rng(parsed.seed)
    diagnosis = diagnose(
        case,
        rng,
        jobs=parsed.jobs,
        without=frozenset(parsed.without),
        progress=progress,
        full=None if axis is None else full_simulator(axis, parsed.jobs),
        within_s=parsed.within,
    )
    _write(parsed, out, diagnosis, progress, rng, axis)


def _warn_of_unused(parsed: argparse.Namespace, taken: Sequence[str]) -> None:
    """Known inputs that were read and that nothing takes."""
    from bayes_hw.commands.speech import warn

    if unused := [name for name in parsed.known if name not in taken]:
        warn(
            f"known inputs ({', '.join(unused)}) are not used beside a given model; diagnose the "
            "records alone to ask whether the gap follows them"
        )


def _write(
    parsed: argparse.Namespace,
    out: Path,
    diagnosis: Diagnosis,
    progress: Progress,
    rng: np.random.Generator,
    axis: SimulatorFile | None = None,
) -> None:
    """Write what was found around a drive train or a simulator, back into `axis` where that is its file."""
    from bayes_hw.commands.speech import say
    from bayes_hw.simulators.simulator_diagnosis import CORRECTED

    def page_of(origin: Provenance) -> Report:
        from bayes_hw.report.diagnosis.diagnosis_report import diagnosis_report

        return diagnosis_report(diagnosis, origin)

    diagnosis.write(out)
    if axis is not None:
        axis.write_corrected(diagnosis, out / CORRECTED, rng)
    records = [*diagnosis.case.train, *diagnosis.case.holdout]
    _say(parsed, out, diagnosis, page_of, records, progress)
    if axis is not None:
        say(f"corrected simulator: {out / CORRECTED / 'simulate.py'}")
    say_next(parsed, *_next(parsed, out, diagnosis.verdict.answer))


def _say(
    parsed: argparse.Namespace,
    out: Path,
    diagnosis: Diagnosis | JointDiagnosis,
    page_of: Callable[[Provenance], Report],
    records: list[Record],
    progress: Progress,
) -> None:
    """Render the page of a diagnosis of all `records` and say what it answers; its sentence without
    one."""
    from bayes_hw.commands.speech import say, say_page
    from bayes_hw.report.page.render import remove_pages, render

    remove_pages(out)
    if parsed.no_report:
        say(diagnosis.sentence())
        say(f"verdict: {out / 'verdict.json'}")
        return
    from bayes_hw.provenance import provenance_of

    with progress.stage("report"):
        page = page_of(provenance_of(parsed, records))
        written = render(page, out)
    say_page(page, written)


def _next(parsed: argparse.Namespace, out: Path, answer: Sequence[str]) -> list[str]:
    """With a simulator that holds: sample it; with one that is corrected: simulate that; else try to do
    without the answer."""
    again = reading_options(parsed)
    folder = Path(parsed.case[0]) if parsed.case else None
    if not answer and parsed.model is not None:
        return ["sample", "--model", parsed.model, *parsed.train, *again, "--out", "posterior/"]
    corrected = out / "corrected.json"
    if answer and corrected.exists():
        record = parsed.holdout[0] if folder is None else str(folder / "holdout.csv")
        return ["simulate", "--model", str(corrected), record, *again, "--out", "repaired.csv"]
    if folder is not None:
        given = [*parsed.case]
    else:
        source = ["--model", parsed.model] if parsed.model is not None else ["--simulator", parsed.simulator]
        source += ["--declaration", parsed.declaration] if parsed.declaration is not None else []
        given = [*source, "--train", *parsed.train, "--holdout", *parsed.holdout]
    named = [label for label in answer if label != "other"]
    without = (
        ["--without", *parsed.without, *named]
        if named or parsed.without
        else ["--seed", str(parsed.seed + 1)]
    )
    return ["diagnose", *given, *without, *again, "--out", f"{out}_again"]


def after_records(out: Path, answer: Sequence[str], train: Sequence[Record]) -> list[str]:
    """A loop for the axis that was found; where something stays unexplained, the experiment that shows it."""
    if "other" not in answer:
        return ["design", "--posterior", str(out), "--out", "design/"]
    fastest = max(max(abs(float(record.u.min())), abs(float(record.u.max()))) for record in train)
    return ["design-experiment", "--posterior", str(out), "--velocity", f"{fastest:.3g}", "--out", "next/"]


def default_out(parsed: argparse.Namespace) -> str:
    """NAME_diagnosis in the working folder, NAME that of the case folder, the model or the simulator."""
    if parsed.case:
        first = Path(parsed.case[0]).resolve()
        name = first.name if first.is_dir() else first.stem
    else:
        named = (parsed.simulator or "").partition(":")[0]
        name = Path(parsed.model or named).stem if parsed.model or named else ""
    return f"{name}_diagnosis" if name else "diagnosis"


def _own_model(model: str, train: Sequence[Record]) -> bool:
    """Whether a model.json, or that of a case folder, says that it was identified from these records."""
    import json

    from bayes_hw.files import read_small_text

    path = Path(model)
    try:
        if path.is_dir():
            path = path / json.loads(read_small_text(path / "case.json"))["model"]
        named = json.loads(read_small_text(path)).get("records", [])
        digests = {item["sha256"] for item in named} - {""}
    except (OSError, ValueError, AttributeError, KeyError, TypeError, RecursionError):
        return False
    return any(record.sha256 in digests for record in train)


def _from_records(parsed: argparse.Namespace, out: Path) -> None:
    """Diagnose records without any model; where none is held out, a part of them is."""
    from bayes_hw.commands.records import axis_name, records_of
    from bayes_hw.commands.speech import note
    from bayes_hw.files import check_output_folder
    from bayes_hw.held_out import held_out_of

    if parsed.train:
        raise InputError("--train goes with --model or --simulator; give the records themselves")
    if parsed.without:
        raise InputError("--without goes with a model; without one every effect is tried")
    check_output_folder(out)
    given = records_of(parsed, parsed.case, parsed.holdout, start="rest")
    chosen = held_out_of(given.records, given.holdout, parsed.start, parsed.origin)
    for done in chosen.notes:
        note(done)
    title = parsed.title or axis_name(parsed.case)
    _joint(parsed, out, chosen.train, chosen.holdout, title, chosen.notes, lead=chosen.lead)


def _joint(
    parsed: argparse.Namespace,
    out: Path,
    train: Sequence[Record],
    holdout: Sequence[Record],
    name: str,
    notes: Sequence[str],
    lead: int = 0,
) -> None:
    """Infer structure, effect and noise together, and write; the first `lead` samples held out only lead
    in."""
    import numpy as np

    from bayes_hw.gap.joint.joint_diagnosis import diagnose_records
    from bayes_hw.progress import Progress

    progress = Progress(parsed.quiet)
    diagnosis = diagnose_records(
        train,
        holdout,
        np.random.default_rng(parsed.seed),
        name=name,
        notes=notes,
        progress=progress,
        lead=lead,
        drive=drive_of(parsed),
        start=parsed.start,
        jobs=parsed.jobs,
        within_s=parsed.within,
    )
    _write_joint(parsed, out, diagnosis, [*train, *holdout], progress)


def _write_joint(
    parsed: argparse.Namespace,
    out: Path,
    diagnosis: JointDiagnosis,
    records: list[Record],
    progress: Progress,
) -> None:
    """Write what was found without a drive train from all `records`."""
    from bayes_hw.commands.speech import warn
    from bayes_hw.gap.effects.catalogue import known_labels
    from bayes_hw.gap.effects.labels import LABEL_BLOCKS

    def page_of(origin: Provenance) -> Report:
        from bayes_hw.report.diagnosis.joint_report import joint_report

        return joint_report(diagnosis, origin)

    if added := [label for label in known_labels() if label not in LABEL_BLOCKS]:
        warn(f"effects of other packages are tried around a drive train alone, not here: {', '.join(added)}")
    diagnosis.write(out)
    _say(parsed, out, diagnosis, page_of, records, progress)
    say_next(parsed, *after_records(out, diagnosis.verdict.answer, diagnosis.train))
