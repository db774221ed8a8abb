"""Records from the options of a command, checked and posed."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from bayes_hw.commands.inputs import read_records
from bayes_hw.commands.speech import note
from bayes_hw.entrance import SimulatedAxis, enter
from bayes_hw.posing import Posed


def records_of(
    parsed: argparse.Namespace,
    paths: Sequence[str],
    holdout: Sequence[str] = (),
    model: SimulatedAxis | None = None,
    needs_output: bool = True,
) -> Posed:
    """The records at `paths`, and those held out, as --origin and --start ask for them; says what was done.

    Raises InputError on what `read_records` and `enter` refuse.
    """
    units = None if model is None else model.units
    records = read_records(parsed, paths, units, needs_output=needs_output)
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
    for sentence in found.notes:
        note(sentence)
    return found
