"""Records and settings from the options, checked."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from bayes_hw.column_roles.found_columns import TAKEN
from bayes_hw.commands.speech import note, warn
from bayes_hw.entrance import RELATIONS, scale_finding
from bayes_hw.errors import InputError, storable_text
from bayes_hw.inspection.mends import mixed_units
from bayes_hw.record import Columns, ReadingOptions, Record, Units

if TYPE_CHECKING:
    from bayes_hw.infer.sampler import SamplerSettings
    from bayes_hw.model.hammerstein_wiener import HammersteinWiener


def reading_options(parsed: argparse.Namespace, *, needs_output: bool = True) -> ReadingOptions:
    """How records are read, as the options of `add_record_options` say."""
    for option, given in (("--input-unit", parsed.input_unit), ("--output-unit", parsed.output_unit)):
        storable_text(given or "", option)
    units = {"input": parsed.input_unit, "output": parsed.output_unit}
    return ReadingOptions(
        columns=Columns(
            time=None if parsed.time == "none" else parsed.time,
            input=parsed.input,
            output=None if parsed.output == "none" and not needs_output else parsed.output,
        ),
        sample_rate_hz=parsed.sample_rate,
        resample_hz=parsed.resample,
        units={role: unit for role, unit in units.items() if unit},
        time_unit=parsed.time_unit,
        input_position=parsed.input_position,
        output_time=parsed.output_time,
        join=tuple(map(Path, parsed.join)),
        clock_offset=parsed.clock_offset,
        gaps=parsed.gaps,
        unwrap=parsed.unwrap,
        known=tuple(parsed.known),
        part_s=None if parsed.part is None else (parsed.part[0], parsed.part[1]),
        reverse=parsed.reverse,
        ignore_units=parsed.ignore_units,
        missing=tuple(parsed.missing),
        needs_output=needs_output,
    )


def read_records(
    parsed: argparse.Namespace,
    paths: Sequence[str],
    units: Units | None = None,
    *,
    needs_output: bool = True,
) -> list[Record]:
    """The records at `paths` as the options say; `units` are the model's, where there is one.

    A record in other units than the model's, or the first record's, is converted; one whose units neither
    file nor options state is taken to be in theirs. What was found to be decided about a file is said on
    stderr.

    Raises InputError when units cannot be converted, or a record is not what it is said to be and
    `parsed.accept` does not say that it is.
    """
    options = reading_options(parsed, needs_output=needs_output)
    records: list[Record] = []
    taken: list[str] = []
    for path in paths:
        parts = read_once(parsed, path, options)
        first = parts[0]
        if first.treatment and first.treatment[0].startswith(TAKEN) and first.treatment[0] not in taken:
            taken.append(first.treatment[0])
            note(f"{path}: {taken[-1]}")
        if len(parts) > 1 and getattr(parsed, "start", "free") == "rest":
            warn(
                f"{path}: {len(parts)} records; those after a gap may begin in motion: --start free allows it"
            )
        for record in parts:
            target = units or (records[0].units if records else None)
            if target is not None:
                record = in_units(record, target)
            later = is_simulated(parsed)
            refuse_faults(record, parsed.accept, alone=not is_compared(parsed), later=later)
            for finding in record.findings():
                asked = finding.kind == "inverted" and is_compared(parsed)
                if not asked and not (later and finding.kind in RELATIONS):
                    warn(f"{record.source or record.name}: {finding}")
            records.append(record)
    if units is None and records and parsed.output_unit is None and (said := mixed_units(records[0])):
        note(f"{records[0].name}: {said}")
    return records


def read_once(parsed: argparse.Namespace, path: str, options: ReadingOptions) -> list[Record]:
    """The records of a file, from `parsed.read_already` where they were read before the command began.

    Columns that were found in the first file are taken in the others that have them.
    """
    already: dict[tuple[str, str], list[Record]] = getattr(parsed, "read_already", {})
    key = (path, repr(options))
    if key not in already:
        found = next((records[0].options for records in already.values()), options)
        try:
            already[key] = Record.read_all(path, found)
        except InputError:
            if found == options:
                raise
            already[key] = Record.read_all(path, options)
    return already[key]


def read_record(
    parsed: argparse.Namespace, path: str, units: Units | None = None, *, needs_output: bool = True
) -> Record:
    """One record; raises InputError where gaps make several of it."""
    records = read_records(parsed, [path], units, needs_output=needs_output)
    if len(records) > 1:
        raise InputError(
            f"{path}: its gaps make {len(records)} records of it; take one with --part START STOP (s), or "
            "write them "
            "with bayes-hw convert"
        )
    return records[0]


def in_units(record: Record, target: Units) -> Record:
    """The record in the units of model or first record; what nobody stated is in them already."""
    if record.units == target:
        return record
    stated = {role: getattr(record.units, role) for role in record.stated_units}
    held = replace(target, **{role: unit for role, unit in stated.items() if role != "time"})
    return replace(record, units=held).converted(target)


def is_compared(parsed: argparse.Namespace) -> bool:
    """Whether the command has a model, a simulator, a posterior or a case beside its records."""
    named = ("model", "simulator", "posterior")
    is_named = any(getattr(parsed, name, None) is not None for name in named)
    return is_named or case_folder(parsed) is not None


def is_simulated(parsed: argparse.Namespace) -> bool:
    """Whether `enter` is given a model to simulate the records' commands with."""
    names_one = getattr(parsed, "model", None) is not None or case_folder(parsed) is not None
    return names_one and getattr(parsed, "simulates_records", False)


def case_folder(parsed: argparse.Namespace) -> str | None:
    """The case folder of a command that takes one; None where its place holds records."""
    given = getattr(parsed, "case", None) or []
    named = given if isinstance(given, list) else [given]
    if len(named) != 1 or getattr(parsed, "holdout", None) or Path(named[0]).is_file():
        return None
    return str(named[0])


def refuse_faults(
    record: Record, accepted: Sequence[str], *, alone: bool = True, later: bool = False
) -> None:
    """Raise InputError at what would be fitted to nonsense, unless it is accepted.

    Where the record is not `alone`, a model or simulator tells how fast it should move, and is asked later;
    where `later` is given too, what its columns are to each other is said by a model as well.
    """
    scale = scale_finding(record) if alone else None
    for finding in (*record.findings(), *([] if scale is None else [scale])):
        if later and finding.kind in RELATIONS:
            continue
        if finding.severity == "fatal" and finding.kind not in accepted:
            remedy = "; bayes-hw inspect prints the command that reads it"
            if f"--accept {finding.kind}" not in finding.remedy:
                remedy += f"; if it is so, give --accept {finding.kind}"
            raise InputError(f"{record.source or record.name}: {finding}{remedy}")


def sampler_settings(parsed: argparse.Namespace) -> SamplerSettings:
    """The sampler's settings from the options, checked."""
    from bayes_hw.infer.sampler import SamplerSettings

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


def add_known_inputs(parsed: argparse.Namespace, model: HammersteinWiener) -> None:
    """The known inputs that a model takes are read from the record even where nobody asks."""
    add_columns(parsed, [one.column for one in model.known])


def add_columns(parsed: argparse.Namespace, columns: Sequence[str]) -> None:
    """Further columns to read."""
    parsed.known = [*parsed.known, *(name for name in columns if name not in parsed.known)]
