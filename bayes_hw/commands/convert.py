"""bayes-hw convert: a record or a model in another format."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bayes_hw.commands.options import add_common, add_output, add_record_options
from bayes_hw.errors import InputError
from bayes_hw.units import Units

if TYPE_CHECKING:
    from bayes_hw.record import Record

NAME = "convert"
SUMMARY = "a record or a model in another format: .csv, .mat, .h5, .parquet; .json, .mat"
EXAMPLE = "bayes-hw convert train_1.csv --out train_1.mat"

RECORD_ENDINGS = (".csv", ".mat", ".h5", ".hdf5", ".hdf", ".parquet", ".pq")
MODEL_ENDINGS = (".json", ".mat")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One file in, one file out."""
    parser.add_argument(
        "source",
        metavar="FILE",
        help="a record (.csv, .mat, iddata in .mat, .h5, .parquet) or a model (.json, idnlhw in .mat)",
    )
    add_output(
        parser, "file to write, its format by its ending; .json, or a model.json given, means a model", "FILE"
    )
    add_record_options(parser)
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Read, check and write; raises InputError on bad input before anything is written."""
    from bayes_hw.commands.inputs import reading_options
    from bayes_hw.commands.next_step import say_next
    from bayes_hw.commands.speech import say, warn
    from bayes_hw.files import check_output_file
    from bayes_hw.formats.json_file import is_model as is_model_file
    from bayes_hw.inspection.mends import after_findings, arguments, findings_of
    from bayes_hw.record import Record

    source, out = Path(parsed.source), Path(parsed.out)
    is_model = out.suffix.lower() == ".json" or (source.suffix.lower() == ".json" and is_model_file(source))
    endings = MODEL_ENDINGS if is_model else RECORD_ENDINGS
    for path, given in ((source, True), (out, False)):
        if (is_model or not given) and path.suffix.lower() not in endings:
            kind = "model" if is_model else "record"
            raise InputError(f"{path}: no ending of a {kind}'s file; use one of {', '.join(endings)}")
    check_output_file(out, [source])
    if is_model:
        from bayes_hw.model.hammerstein_wiener import HammersteinWiener

        model = HammersteinWiener.read(source)
        model.write(out)
        say(f"{out}: model {model.name}, {model.sample_rate_hz:g} Hz, {len(model.linear.poles)} poles")
        say_next(parsed, "simulate", "--model", str(out), "RECORD.csv", "--out", "run.csv")
        return
    records = Record.read_all(source, reading_options(parsed, needs_output=False))
    targets = [out] if len(records) == 1 else numbered(out, len(records))
    for target in targets[1:] if len(records) > 1 else []:
        check_output_file(target, [source])
    for record, target in zip(records, targets, strict=True):
        record.write(target)
    found = [(record, finding) for record in records for finding in findings_of(record)]
    for record, target in zip(records, targets, strict=True):
        say(f"{target}: {len(record)} samples at {record.sample_rate_hz:g} Hz")
        for treatment in record.treatment:
            say(treatment)
        for of_record, finding in found:
            if of_record is record:
                warn(f"{source}: {finding}")
    better, _ = after_findings(found, records[0].options)
    if better is not None:
        say_next(parsed, "convert", str(source), *arguments(better), "--out", str(out))
    elif any(finding.severity == "fatal" for _, finding in found):
        say_next(parsed, "inspect", str(source), *arguments(records[0].options))
    elif parsed.missing:
        say_next(parsed, "report", str(source), *arguments(records[0].options), "--out", "axis/")
    else:
        say_next(parsed, "report", *map(str, targets), *options_of(records), "--out", "axis/")


def options_of(records: Sequence[Record]) -> list[str]:
    """What has to be said to read the files of `records` again: units that a header t,u,y does not say,
    unmeasured samples, further columns."""
    first, plain = records[0], Units()
    units = (
        ("--input-unit", first.units.input, plain.input),
        ("--output-unit", first.units.output, plain.output),
    )
    found = [part for option, held, usual in units if held != usual for part in (option, held)]
    if any(record.has_output and record.measured is not None for record in records):
        found += ["--gaps", "bridge"]
    return [*found, *(part for name in first.known for part in ("--known", name))]


def numbered(out: Path, count: int) -> list[Path]:
    """OUT_1.csv, OUT_2.csv, ... beside where OUT.csv would be."""
    return [out.with_name(f"{out.stem}_{number}{out.suffix}") for number in range(1, count + 1)]
