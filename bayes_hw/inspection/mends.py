"""What inspection makes of a log's faults: the options that mend them, as they are typed."""

from __future__ import annotations

import re
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.entrance import scale_finding
from bayes_hw.quantities import COUNTS, mixed
from bayes_hw.reading_options import ReadingOptions
from bayes_hw.record import Record
from bayes_hw.record_checks import Finding
from bayes_hw.unmeasured import ENDS

FAST = {"deg/s": 720.0, "rad/s": 12.0}
"""A command beyond these, in a unit that no file states, is asked about."""


def findings_of(record: Record) -> tuple[Finding, ...]:
    """Every finding on a record, with that on its scale."""
    found, scale = record.findings(), scale_finding(record)
    return found if scale is None else (*found, scale)


def units_to_ask_for(record: Record) -> list[str]:
    """A sentence where nobody stated the command's unit and its numbers speak against the usual one."""
    if record.units.output.lower() in COUNTS:
        return [
            "the output is in counts: say what one is worth, such as --output-unit '360/4096 deg' "
            "--ignore-units"
        ]
    largest = float(np.abs(record.u).max())
    unit = record.units.input
    if "input" in record.stated_units or largest <= FAST.get(unit, np.inf):
        return []
    return [
        f"no unit is stated and {unit} is taken: {largest:.4g} {unit} is fast for an axis; say what it is, "
        "such as --input-unit arcsec/s --output-unit arcsec"
    ]


def mixed_units(record: Record) -> str | None:
    """A sentence where the file states the angle in one unit and its speed in that of another."""
    if "output" not in record.stated_units:
        return None
    return mixed(record.units.output, record.units.input)


def mended(message: str, options: ReadingOptions) -> ReadingOptions | None:
    """The options with the one that a refusal names."""
    if "--missing " in message:
        reading = message.split("--missing ")[1].split()[0].rstrip(";,.")
        return None if reading in options.missing else replace(options, missing=(*options.missing, reading))
    if "--unwrap " in message and options.unwrap is None:
        turn = message.split("--unwrap ")[1].split()[0].rstrip(";,.")
        return replace(options, unwrap=float(turn))
    if "--gaps bridge" in message and options.gaps == "refuse":
        return replace(options, gaps="bridge")
    if "--gaps split" in message and options.gaps != "split":
        return replace(options, gaps="split")
    if "--time-unit " in message and options.time_unit is None:
        unit = message.split("--time-unit ")[1].split()[0].rstrip(";,.")
        return replace(options, time_unit=unit)
    return None


def after_findings(
    found: Sequence[tuple[Record, Finding]], options: ReadingOptions
) -> tuple[ReadingOptions | None, str]:
    """The options with what mends the first finding that one option mends, and what is said of it."""
    for record, finding in found:
        better = _mending(record, finding, options)
        if better is not None:
            return better, f"{record.name}: {finding}"
    return None, ""


def in_one_unit(record: Record, options: ReadingOptions) -> tuple[ReadingOptions | None, str]:
    """The options that put the angle in the unit whose speed the command is, where the file states another,
    and what is said of it."""
    said = None if "output" in options.units else mixed_units(record)
    if said is None:
        return None, ""
    unit = shlex.split(said.split("--output-unit ")[1])[0]
    return replace(options, units={**options.units, "output": unit}), f"{record.name}: {said}"


def other_units(record: Record, finding: Finding, options: ReadingOptions) -> list[ReadingOptions]:
    """The options with each unit that a finding says may be the right one, in place of what the file
    states."""
    if finding.kind != "scale":
        return []
    found = []
    for name, given in re.findall(r"\(--(input-unit|output-unit|time-unit) ([^)]+)\)", finding.sentence):
        unit = shlex.split(given)[0]
        if name == "time-unit":
            found.append(replace(options, time_unit=unit))
            continue
        held = {role: getattr(record.units, role) for role in record.stated_units if role != "time"}
        units = {**held, **options.units, name.removesuffix("-unit"): unit}
        found.append(replace(options, units=units, ignore_units=options.ignore_units or bool(held)))
    return found


def _mending(record: Record, finding: Finding, options: ReadingOptions) -> ReadingOptions | None:
    columns = options.columns
    if finding.kind == "inverted" and not options.reverse:
        return replace(options, reverse=True)
    if finding.kind == "swapped" and options.input_position is None and columns.output is not None:
        return replace(options, columns=replace(columns, input=columns.output, output=columns.input))
    if finding.kind == "clipped" and ENDS not in options.missing:
        return replace(options, missing=(*options.missing, ENDS))
    if finding.kind == "stuck" and options.part_s is None:
        rate, length = record.sample_rate_hz, len(record)
        before, after = finding.first, length - finding.stop
        part = (0.0, finding.first / rate) if before > after else (finding.stop / rate, length / rate)
        return replace(options, part_s=part)
    return None


def arguments(options: ReadingOptions) -> tuple[str, ...]:
    """The options of the command line that say the same, as far as they differ from what is taken anyway."""
    plain = ReadingOptions()
    columns = options.columns
    found: list[str] = []
    named: Mapping[str, object] = {
        "--time": columns.time if columns.time != "t" else None,
        "--input": columns.input if columns.input != "u" else None,
        "--output": columns.output if columns.output != "y" else None,
        "--input-position": options.input_position,
        "--output-time": options.output_time,
        "--clock-offset": options.clock_offset,
        "--time-unit": options.time_unit,
        "--sample-rate": options.sample_rate_hz,
        "--resample": options.resample_hz,
        "--gaps": options.gaps if options.gaps != plain.gaps else None,
        "--unwrap": options.unwrap,
        "--input-unit": options.units.get("input"),
        "--output-unit": options.units.get("output"),
    }
    for option, value in named.items():
        if value is not None:
            found += [option, f"{value:.15g}" if isinstance(value, float) else str(value)]
    for name in options.known:
        found += ["--known", name]
    for path in options.join:
        found += ["--join", str(path)]
    for reading in options.missing:
        found += ["--missing", str(reading)]
    if options.part_s is not None:
        found += ["--part", *(f"{limit:g}" for limit in options.part_s)]
    flags = {"--reverse": options.reverse, "--ignore-units": options.ignore_units}
    return (*found, *(flag for flag, given in flags.items() if given))
