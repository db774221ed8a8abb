"""What a log holds and what each of its columns is likely to be, from names, units and numbers."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from bayes_hw.column_roles.found_columns import find_columns, named_otherwise
from bayes_hw.column_roles.whole_table import whole_table, with_own_clocks
from bayes_hw.errors import InputError
from bayes_hw.inspection.mends import (
    after_findings,
    arguments,
    findings_of,
    in_one_unit,
    mended,
    other_units,
    units_to_ask_for,
)
from bayes_hw.reading_options import ReadingOptions
from bayes_hw.record import Record
from bayes_hw.record_checks import Finding


@dataclass(frozen=True)
class Inspection:
    """What was found: lines to read, the options that read the file as they are typed, and the questions that
    are open, each naming the option that answers it; `choices` are the options of each answer that there may
    be."""

    lines: tuple[str, ...]
    arguments: tuple[str, ...]
    questions: tuple[str, ...]
    choices: tuple[tuple[str, ...], ...] = ()

    def command(self, path: Path, name: str = "convert", out: str = "record.csv") -> str:
        """The exact command line."""
        return _line(path, name, self.arguments, out)

    def answers(self, path: Path, out: str) -> list[str]:
        """The command line of each choice."""
        return [_line(path, "convert", chosen, out) for chosen in self.choices]


def _line(path: Path, name: str, arguments: Sequence[str], out: str) -> str:
    return shlex.join(["bayes-hw", name, str(path), *arguments, "--out", out])


def inspect_file(path: Path, given: ReadingOptions | None = None) -> Inspection:
    """Look at a file; roles that `given` names other than by default are taken as they are.

    Raises InputError where the file cannot be read as a table at all.
    """
    options = given or ReadingOptions()
    clocks = partial(with_own_clocks, path)
    found = find_columns(path, whole_table(path), clocks, options, *named_otherwise(options))
    if found.questions:
        return Inspection(found.lines, (), found.questions)
    return _tried(path, found.options, list(found.lines))


def _tried(path: Path, options: ReadingOptions, lines: list[str]) -> Inspection:
    """The record read with these options, and with those that its refusals and findings name."""
    tried: list[str] = []
    for _ in range(5):
        try:
            records = Record.read_all(path, options)
            found = [(record, finding) for record in records for finding in findings_of(record)]
        except InputError as error:
            message = str(error)
            better = mended(message, options)
            if better is None or message in tried:
                return Inspection(tuple(lines), (), (message,))
            tried.append(message)
            lines.append(message.removeprefix(f"{path}: "))
            options = better
            continue
        better, sentence = after_findings(found, options)
        if better is None:
            better, sentence = in_one_unit(records[0], options)
        if better is None or sentence in tried:
            break
        tried.append(sentence)
        lines.append(sentence)
        options = better
    else:
        return Inspection(tuple(lines), (), (tried[-1],))
    for record in records:
        lines.append(
            f"{record.name}: {len(record)} samples at {record.sample_rate_hz:g} Hz, "
            f"{record.duration_s:.4g} s, "
            f"command in {record.units.input}, output in {record.units.output}"
        )
        lines += [f"  {said}" for said in record.treatment if said not in lines]
        lines += [f"  look at: {f}" for r, f in found if r is record and f.severity == "warning"]
        lines += [f"  look at: {said}" for said in units_to_ask_for(record)]
    fatal = next(((r, f) for r, f in found if f.severity == "fatal"), None)
    if fatal is None:
        return Inspection(tuple(lines), arguments(options), ())
    choices = tuple(map(arguments, other_units(*fatal, options)))
    return Inspection(tuple(lines), arguments(options), (_named(*fatal, records),), choices)


def _named(record: Record, finding: Finding, records: Sequence[Record]) -> str:
    """The finding, with the name of the part that shows it where there are several."""
    return str(finding) if len(records) == 1 else f"{record.name}: {finding}"
