"""Records from the options of a command, checked and posed."""

from __future__ import annotations

import argparse
import re
from collections.abc import Mapping, Sequence
from itertools import takewhile
from pathlib import Path

from bayes_hw.arrays import FloatArray
from bayes_hw.commands.inputs import read_records
from bayes_hw.commands.speech import note
from bayes_hw.entrance import SimulatedAxis, enter
from bayes_hw.posing import Posed, Start
from bayes_hw.quantities import conversion, with_step
from bayes_hw.record import Record, Units

GENERIC = {
    "csv", "data", "dataset", "download", "downloads", "file", "files", "log", "logs",
    "measurement", "measurements", "night", "nights", "record", "recording", "recordings",
    "records", "run", "runs", "sample", "samples", "telemetry", "temp", "test", "tests", "tmp",
    "train", "training",
}  # fmt: skip
"""Words that name no axis."""

_WORD_ENDS = re.compile(r"[\W_]+")


def axis_name(records: Sequence[str]) -> str:
    """What the axis of some records is called: what their names begin with in common, else the folder that
    holds them all, else the first record; words that any log has are no name."""
    stems = [Path(record).stem for record in records]
    if (common := _beginning(stems)) is not None:
        return common
    folders = {Path(record).resolve().parent for record in records}
    name = folders.pop().name if len(folders) == 1 else ""
    return stems[0] if name.lower() in {"", *GENERIC} else name


def _beginning(stems: Sequence[str]) -> str | None:
    """The words that all of some names begin with, as the first of them spells these; None where they name
    nothing."""
    words = [_WORD_ENDS.split(stem) for stem in stems]
    shared = [held[0] for held in takewhile(lambda held: len(set(held)) == 1, zip(*words, strict=False))]
    while shared and (shared[-1].lower() in GENERIC or not any(map(str.isalpha, shared[-1]))):
        shared.pop()
    if not shared or all(word.lower() in GENERIC for word in shared):
        return None
    place = 0
    for word in shared:
        place = stems[0].index(word, place) + len(word)
    return stems[0][:place]


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
    start: Start | None = None,
) -> Posed:
    """The records at `paths`, and those held out, as --origin and --start ask for them, or as `start` does
    where it is given; says what was done.

    Raises InputError on what `read_records` and `enter` refuse.
    """
    units = None if model is None else model.units
    records: Sequence[Record] = read_records(parsed, paths, units, needs_output=needs_output)
    held_out = read_records(parsed, holdout, units or records[0].units) if holdout else []
    found = enter(
        records,
        held_out,
        model=model,
        origin=parsed.origin,
        start=start or parsed.start,
        accepted=parsed.accept,
        looked_at=True,
    )
    for sentence in found.notes:
        note(sentence)
    return found
