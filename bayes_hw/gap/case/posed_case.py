"""A case as the diagnosis takes it: checked, its angles counted from where every record begins, at rest."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

from bayes_hw.entrance import check_repeats, enter
from bayes_hw.errors import InputError
from bayes_hw.gap.case.case import SHORTEST, Case
from bayes_hw.gap.case.simulator_case import SimulatorCase
from bayes_hw.posing import Origin, Start, rested

APART = 1e-3
"""Beginnings farther apart, in travels, are different places of the axis."""


def posed_case(
    case: Case | SimulatorCase,
    *,
    origin: Origin = "start",
    start: Start = "auto",
    accepted: Collection[str] = (),
    looked_at: bool = False,
) -> tuple[Case | SimulatorCase, tuple[str, ...]]:
    """The case with its records as `bayes_hw.entrance.enter` poses them, and in words what was done.

    A record that begins in motion is cut to where it first rests, unless `start` is "rest"; that of a
    simulator of one's own begins as that simulator does, and is only looked at. Raises InputError on
    mistakes, and where too little of a record is left. `accepted` and `looked_at` as there.
    """
    if isinstance(case, SimulatorCase):
        check_repeats(case.train, case.holdout)
        return case, ()
    train, holdout = case.train, case.holdout
    train, cut = rested(train, start)
    holdout, held_out_cut = rested(holdout, start)
    notes = [*cut, *held_out_cut]
    for record in (*train, *holdout):
        if start != "rest" and len(record) < SHORTEST:
            raise InputError(f"{record.name}: {len(record)} samples from rest on; give {SHORTEST} or more")
    found = enter(
        train, holdout, model=case.model, origin=origin, start="rest", accepted=accepted, looked_at=looked_at
    )
    origins = [record.origin for record in (*found.records, *found.holdout)]
    travel = max(float(abs(record.y).max()) for record in found.records)
    if max(origins) - min(origins) > APART * travel:
        notes.append(
            f"records begin at {min(origins):.6g} to {max(origins):.6g} {case.model.units.output}: effects "
            "of the axis's position are looked for in the angle from each record's beginning; records that "
            "begin at one angle show them best"
        )
    return replace(case, train=found.records, holdout=found.holdout), (*found.notes, *notes)
