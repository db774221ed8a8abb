"""What a log holds and what each of its columns is likely to be, from names, units and numbers."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.header import is_time_name, quantity_of
from bayes_hw.formats.readers import read_table
from bayes_hw.formats.table import Column, Table
from bayes_hw.formats.text_layout import is_value
from bayes_hw.inspection.clock_column import (
    clock_of,
    no_clock,
    on_one_clock,
    rate_of,
    rows_of,
    second_clock,
)
from bayes_hw.inspection.column_facts import ColumnFacts, column_facts, filled, line_of
from bayes_hw.inspection.mends import (
    after_findings,
    arguments,
    findings_of,
    in_one_unit,
    mended,
    units_to_ask_for,
)
from bayes_hw.inspection.roles import MOST_COLUMNS, roles_of
from bayes_hw.log.clock import Stamps
from bayes_hw.log.resample import MOST_SAMPLES
from bayes_hw.reading_options import ReadingOptions
from bayes_hw.record import Record
from bayes_hw.record_checks import Finding


@dataclass(frozen=True)
class Inspection:
    """What was found: lines to read, the options that read the file as they are typed, and the questions that
    are open, each naming the option that answers it."""

    lines: tuple[str, ...]
    arguments: tuple[str, ...]
    questions: tuple[str, ...]

    def command(self, path: Path, name: str = "convert", out: str = "record.csv") -> str:
        """The exact command line."""
        return shlex.join(["bayes-hw", name, str(path), *self.arguments, "--out", out])


def inspect_file(path: Path, given: ReadingOptions | None = None) -> Inspection:
    """Look at a file; roles that `given` names other than by default are taken as they are.

    Raises InputError where the file cannot be read as a table at all.
    """
    table = _whole(path)
    options = given or ReadingOptions()
    lines = [_extent(path, table), *table.said]
    clock, clock_name, why = clock_of(table, options)
    own_clocks = False
    if clock is None or not _of_one_length(table):
        signals, common = on_one_clock(_signals(path, table), options)
        if common is not None:
            table, clock, clock_name, own_clocks = signals, common, None, True
    facts = [column_facts(name, table, table.values[name]) for name in table.values if name != clock_name]
    if own_clocks and clock is not None:
        lines.append(f"  every signal has a clock of its own; {clock.said or 'numbers in s'}")
    if clock_name is not None and clock is not None:
        lines.append(f"  {clock_name!r}: the clock ({why}); {clock.said or 'numbers in s'}")
    lines += [line_of(each) for each in facts]
    for joined in options.join:
        more, said = _joined(joined, clock, options)
        facts += more
        lines += said
    rate = rate_of(clock, options)
    questions: list[str] = []
    if rate is None:
        questions.append(no_clock(table, options))
        return Inspection(tuple(lines), (), tuple(questions))
    if not own_clocks:
        options = replace(options, columns=replace(options.columns, time=clock_name))
    options, sentences, questions = roles_of(facts, rate, options, given or ReadingOptions())
    lines += sentences
    if not questions and options.output_time is None and clock is not None:
        options, sentences = second_clock(table, clock, options)
        lines += sentences
    if questions:
        return Inspection(tuple(lines), (), tuple(questions))
    return _tried(path, options, lines)


def _extent(path: Path, table: Table) -> str:
    """Columns and rows, the rows counted as where the file is spoken of."""
    rows = rows_of(table)
    counted = f" of values, {table.place(0)} to {table.place(rows - 1)} of the file" if rows else ""
    return f"{path}: {len(table.names)} {table.kind}s, {rows} rows{counted}"


def _joined(path: Path, base: Stamps | None, options: ReadingOptions) -> tuple[list[ColumnFacts], list[str]]:
    """The columns of a file to be joined, at the stamps of the record's own clock."""
    table = _whole(path)
    clock, clock_name, why = clock_of(table, options)
    facts = [column_facts(name, table, table.values[name]) for name in table.values if name != clock_name]
    lines = [_extent(path, table), *table.said]
    if clock is None or base is None:
        return [], [*lines, *map(line_of, facts)]
    lines += [f"  {clock_name!r}: the clock ({why}); {clock.said or 'numbers in s'}", *map(line_of, facts)]
    origin = clock.origin_ns if clock.origin_ns is not None else 0
    when = clock.seconds + (0.0 if base.origin_ns is None else (origin - base.origin_ns) / 1e9)
    at = [
        replace(each, values=np.interp(base.seconds, when, filled(each.values)))
        for each in facts
        if len(each.values) == len(when) and np.isfinite(each.values).any()
    ]
    return at, lines


def _whole(path: Path) -> Table:
    """Every column, as numbers where it has them, else as text."""
    names = read_table(path, ["1", "\0"], ["1"], most_rows=1).names
    names = names[: 4 * MOST_COLUMNS]
    try:
        return _numbers_in_text(path, read_table(path, list(names), list(names), most_rows=MOST_SAMPLES))
    except InputError:
        found: dict[str, Table] = {}
        for name in names:
            try:
                found[name] = read_table(path, [name], [name], most_rows=MOST_SAMPLES)
            except InputError:
                continue
        if not found:
            raise
        first = next(iter(found.values()))
        return replace(
            first,
            values={name: table.values[name] for name, table in found.items() if name in table.values},
            clocks={name: clock for table in found.values() for name, clock in table.clocks.items()},
            clock_units={n: unit for table in found.values() for n, unit in table.clock_units.items()},
            units={name: unit for table in found.values() for name, unit in table.units.items()},
        )


def _of_one_length(table: Table) -> bool:
    return len({len(values) for values in table.values.values()}) < 2


def _signals(path: Path, table: Table) -> Table:
    """The columns that are no stamps, each with the clock that stands beside it, where a file has them."""
    names = [name for name in table.values if not is_time_name(name)]
    try:
        found = read_table(path, names, [], most_rows=MOST_SAMPLES)
    except InputError:
        return table
    return replace(found, names=table.names)


def _numbers_in_text(path: Path, table: Table) -> Table:
    """With the columns of text that are no stamps read as numbers, such as sexagesimal angles, where all
    their cells are."""
    for name, values in table.values.items():
        if is_time_name(name) or not _begins_with_number(values):
            continue
        try:
            found = read_table(path, [name], [], most_rows=MOST_SAMPLES)
        except InputError:
            continue
        if name in found.values and np.isfinite(found.values[name]).any():
            table = replace(
                table,
                values={**table.values, name: found.values[name]},
                units={**table.units, **found.units},
            )
    return table


def _begins_with_number(values: Column) -> bool:
    """Whether the first cell of text that is not empty is a number, sexagesimal or with a unit."""
    if values.dtype.kind not in "UO":
        return False
    first = next((cell for cell in map(str, values) if cell.strip()), "")
    return is_value(first) or quantity_of(first) is not None


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
    fatal = next((_named(r, f, records) for r, f in found if f.severity == "fatal"), None)
    questions = () if fatal is None else (fatal,)
    return Inspection(tuple(lines), arguments(options), questions)


def _named(record: Record, finding: Finding, records: Sequence[Record]) -> str:
    """The finding, with the name of the part that shows it where there are several."""
    return str(finding) if len(records) == 1 else f"{record.name}: {finding}"
