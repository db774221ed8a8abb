"""Records from the options of a command, checked and posed."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path

from bayes_hw.arrays import FloatArray
from bayes_hw.commands.inputs import read_records
from bayes_hw.commands.speech import note
from bayes_hw.entrance import SimulatedAxis, enter
from bayes_hw.posing import Posed, rested
from bayes_hw.quantities import conversion, with_step
from bayes_hw.record import Record, Units


def axis_name(records: Sequence[str]) -> str:
    """What the axis of some records is called: the folder that holds them all, else the first record."""
    folders = {Path(record).resolve().parent for record in records}
    name = folders.pop().name if len(folders) == 1 else ""
    return name or Path(records[0]).stem


def in_asked_units(
    parsed: argparse.Namespace, columns: Mapping[str, FloatArray], units: Units
) -> dict[str, FloatArray]:
    """Columns to be written, which are in the model's `units`, in those of --input-unit and --output-unit:
    what goes in comes out.

    Raises InputError where they measure something else.
    """
    factors = {
        role: 1.0 if asked is None else conversion(held, with_step(asked)[1])
        for role, asked, held in (
            ("u", parsed.input_unit, units.input),
            ("y", parsed.output_unit, units.output),
        )
    }
    return {
        name: values if name == "t" else values * factors["u" if name == "u" else "y"]
        for name, values in columns.items()
    }


def records_of(
    parsed: argparse.Namespace,
    paths: Sequence[str],
    holdout: Sequence[str] = (),
    model: SimulatedAxis | None = None,
    needs_output: bool = True,
    at_rest: bool = False,
) -> Posed:
    """The records at `paths`, and those held out, as --origin and --start ask for them; says what was done.

    Where the estimate has to begin `at_rest`, records of `paths` are cut as `rested` does.

    Raises InputError on what `read_records` and `enter` refuse.
    """
    units = None if model is None else model.units
    records: Sequence[Record] = read_records(parsed, paths, units, needs_output=needs_output)
    cut: tuple[str, ...] = ()
    if at_rest:
        records, cut = rested(records, parsed.start)
    held_out = read_records(parsed, holdout, units or records[0].units) if holdout else []
    found = enter(
        records,
        held_out,
        model=model,
        origin=parsed.origin,
        start=parsed.start,
        accepted=parsed.accept,
        looked_at=True,
    )
    for sentence in (*cut, *found.notes):
        note(sentence)
    return found
