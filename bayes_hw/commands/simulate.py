"""bayes-hw simulate: what a model says without noise."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from bayes_hw.commands.options import RECORD_HELP, add_common, add_output, add_record_options, add_start
from bayes_hw.errors import InputError

if TYPE_CHECKING:
    from bayes_hw.gap.answer.corrected_train import TrainSimulation
    from bayes_hw.gap.joint.response.kernel_numbers import Simulated
    from bayes_hw.model.hammerstein_wiener import Simulation

NAME = "simulate"
SUMMARY = "noise-free response of a model to a record's command"
EXAMPLE = "bayes-hw simulate --model model/model.json train_1.csv --out run.csv"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """One model, one record."""
    parser.add_argument("record", metavar="RECORD", help=RECORD_HELP)
    parser.add_argument("--model", required=True, metavar="MODEL.json", help="the model to simulate")
    add_output(
        parser,
        "CSV file with columns t,u,y,w,y_model; without y where the record is a command alone",
        "FILE.csv",
    )
    add_record_options(parser)
    add_start(parser)
    add_common(parser)


def run(parsed: argparse.Namespace) -> None:
    """Simulate and write; raises InputError where the response overflows."""
    import numpy as np

    from bayes_hw.commands.inputs import add_known_inputs
    from bayes_hw.commands.next_step import reading_options, say_next
    from bayes_hw.commands.records import in_asked_units, records_of
    from bayes_hw.commands.speech import say
    from bayes_hw.files import check_output_file, write_csv
    from bayes_hw.gap.joint.answer.corrected_model import read_corrected, simulate_corrected
    from bayes_hw.infer.start_state import simulate_from_motion
    from bayes_hw.model.hammerstein_wiener import HammersteinWiener

    out = Path(parsed.out)
    check_output_file(out, [Path(parsed.record), Path(parsed.model)], ".csv")
    model = HammersteinWiener.read(parsed.model)
    corrected = read_corrected(parsed.model)
    add_known_inputs(parsed, model)
    given = records_of(parsed, [parsed.record], model=model, needs_output=False)
    (record,) = given.records
    simulation: Simulation | Simulated | TrainSimulation
    if corrected is not None:
        simulation = simulate_corrected(corrected, record.u, record.known)
    elif given.start == "free" and record.has_output:
        simulation = simulate_from_motion(model, record)
    else:
        simulation = model.simulate(record.u, known=record.known)
    if not np.isfinite(simulation.w).all():
        raise InputError(f"{parsed.model}: its response overflows; check linear.gain and the zeros")
    columns = {name: values for name, values in record.columns().items() if name not in record.known}
    columns |= {"w": simulation.w + record.origin, "y_model": simulation.y + record.origin}
    write_csv(out, in_asked_units(parsed, columns, record.units))
    say(f"{out}: {len(record)} samples of {model.name} at the command of {record.name}")
    again = reading_options(parsed)
    if corrected is None:
        measured = parsed.record if record.has_output else "HOLDOUT.csv"
        named = ["--train", "TRAIN.csv", "--holdout", measured, *again, "--out", "diagnosis/"]
        say_next(parsed, "diagnose", "--model", parsed.model, *named)
    else:
        folder = ["--posterior", str(Path(parsed.model).parent)]
        say_next(parsed, "predict", *folder, parsed.record, *again, "--out", "bands.csv")
