"""Clock, command and output of a log whose columns nobody named."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayes_hw.column_roles.clock_column import (
    clock_of,
    no_clock,
    on_one_clock,
    rate_of,
    rows_of,
    second_clock,
)
from bayes_hw.column_roles.column_facts import ColumnFacts, column_facts, filled, line_of, moves, no_number
from bayes_hw.column_roles.roles import roles_of
from bayes_hw.column_roles.whole_table import whole_table
from bayes_hw.errors import InputError
from bayes_hw.formats.header import split_name
from bayes_hw.formats.split_seconds import halves_of
from bayes_hw.formats.table import Table
from bayes_hw.log.clock import Stamps
from bayes_hw.reading_options import Columns, ReadingOptions

TAKEN = "columns taken by their names and numbers: "


@dataclass(frozen=True)
class FoundColumns:
    """The options with what was found, lines that say why, the questions that are open, each naming the
    option that answers it, and the columns that move, but for the clock."""

    options: ReadingOptions
    lines: tuple[str, ...]
    questions: tuple[str, ...]
    moving: tuple[str, ...] = ()


def named_otherwise(options: ReadingOptions) -> tuple[str | None, str | None]:
    """The columns of command and output that are named other than by default."""
    columns, plain = options.columns, Columns()
    command = options.input_position or (columns.input if columns.input != plain.input else None)
    return command, columns.output if columns.output != plain.output else None


def find_columns(
    path: Path,
    table: Table,
    own_clocks_of: Callable[[Table], Table],
    options: ReadingOptions,
    command: str | None,
    output: str | None,
) -> FoundColumns:
    """The roles of a table's columns; `command` and `output` are taken as they are where they are named.

    `own_clocks_of` gives the table with the clocks of single columns, where it has no common one.
    """
    lines = [_extent(path, table), *table.said]
    clock, clock_name, why = clock_of(table, options)
    own_clocks = False
    if clock is None or not _of_one_length(table):
        signals, common = on_one_clock(own_clocks_of(table), options)
        if common is not None:
            table, clock, clock_name, own_clocks = signals, common, None, True
    clocks = [half for name in table.values for half in halves_of(name) or ()]
    clocks += [name for name in table.values if halves_of(name) is not None]
    facts = [
        column_facts(name, table, table.values[name])
        for name in table.values
        if name not in (clock_name, *options.known, *clocks)
    ]
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
    if rate is None:
        asked = no_number(table, list(table.values)) or no_clock(table, options)
        return FoundColumns(options, tuple(lines), (asked,))
    if not own_clocks:
        options = replace(options, columns=replace(options.columns, time=clock_name))
    options, sentences, questions = roles_of(facts, rate, options, command, output)
    if questions:
        texts = [each.name for each in facts if each.name in table.values]
        fault = _named_twice(table) or no_number(table, texts)
        questions = questions if fault is None else [fault]
    lines += sentences
    if not questions and options.output_time is None and clock is not None:
        options, sentences = second_clock(table, clock, options)
        lines += sentences
    return FoundColumns(options, tuple(lines), tuple(questions), tuple(e.name for e in facts if moves(e)))


def _named_twice(table: Table) -> str | None:
    """What is asked where the columns that are left have names that others have as well."""
    twice = [name for name, times in Counter(table.names).items() if times > 1 and name not in table.values]
    if not twice:
        return None
    return f"{table.kind} {twice[0]!r} is there twice, so that its name tells nothing; rename one of them"


def may_be_found(lacking: Collection[str], options: ReadingOptions) -> bool:
    """Whether columns are `lacking`, by their roles, that nobody named."""
    command, output = named_otherwise(options)
    time = options.columns.time if options.columns.time != Columns.time else None
    named = [role for role, name in (("time", time), ("input", command), ("output", output)) if name]
    return bool(lacking) and not set(named) & set(lacking)


def found_options(
    path: Path,
    table: Table,
    own_clocks_of: Callable[[Table], Table],
    options: ReadingOptions,
    lacking: Sequence[str],
) -> tuple[ReadingOptions, tuple[str, ...]]:
    """The options with the columns found that are `lacking`, and what was taken.

    They are as they were where the table has columns that cannot be read. Raises InputError, naming the
    option that answers it, where a question is open.
    """
    wanted = options.wanted
    if table.missing:
        return options, ()
    command, output = (None if role in lacking else wanted.get(role) for role in ("input", "output"))
    found = find_columns(path, table, own_clocks_of, options, command, output)
    better, questions = found.options, found.questions
    if questions and not options.needs_output and command is None and len(found.moving) == 1:
        better = replace(better, columns=replace(better.columns, input=split_name(found.moving[0])[0]))
        questions = ()
    if questions:
        shown = ", ".join(repr(name[:40]) for name in table.names[:20])
        raise InputError(
            f"{path}: no {table.kind} {wanted[lacking[0]]!r} for the {lacking[0]}; it has {shown or 'none'}: "
            f"{questions[0].removeprefix(f'{path}: ')}"
        )
    words = {"time": "time", "input": "position" if better.input_position else "command", "output": "output"}
    taken = [f"{words[role]} {name!r}" for role, name in better.wanted.items() if name != wanted.get(role)]
    return better, (f"{TAKEN}{', '.join(taken)}",)


def _of_one_length(table: Table) -> bool:
    return len({len(values) for values in table.values.values()}) < 2


def _extent(path: Path, table: Table) -> str:
    """Columns and rows, the rows counted as where the file is spoken of."""
    rows = rows_of(table)
    counted = f" of values, {table.place(0)} to {table.place(rows - 1)} of the file" if rows else ""
    return f"{path}: {len(table.names)} {table.kind}s, {rows} rows{counted}"


def _joined(path: Path, base: Stamps | None, options: ReadingOptions) -> tuple[list[ColumnFacts], list[str]]:
    """The columns of a file to be joined, at the stamps of the record's own clock."""
    table = whole_table(path)
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
