"""bayes-hw convert: a record or a model in another format."""

from __future__ import annotations

import argparse
from pathlib import Path

from bayes_hw.commands.options import add_common, add_output, add_record_options
from bayes_hw.errors import InputError

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
    from bayes_hw.commands.inputs import read_records
    from bayes_hw.commands.next_step import say_next
    from bayes_hw.commands.speech import say
    from bayes_hw.files import check_output_file
    from bayes_hw.model.hammerstein_wiener import HammersteinWiener

    source, out = Path(parsed.source), Path(parsed.out)
    is_model = ".json" in (source.suffix.lower(), out.suffix.lower())
    endings = MODEL_ENDINGS if is_model else RECORD_ENDINGS
    for path, given in ((source, True), (out, False)):
        if (is_model or not given) and path.suffix.lower() not in endings:
            kind = "model" if is_model else "record"
            raise InputError(f"{path}: no ending of a {kind}'s file; use one of {', '.join(endings)}")
    check_output_file(out, [source])
    if is_model:
        model = HammersteinWiener.read(source)
        model.write(out)
        say(f"{out}: model {model.name}, {model.sample_rate_hz:g} Hz, {len(model.linear.poles)} poles")
        say_next(parsed, "simulate", "--model", str(out), "RECORD.csv", "--out", "run.csv")
        return
    (record,) = read_records(parsed, [str(source)])
    record.write(out)
    say(f"{out}: {len(record)} samples at {record.sample_rate_hz:g} Hz")
    for treatment in record.treatment:
        say(treatment)
    say_next(parsed, "report", str(out), "--out", "axis/")
