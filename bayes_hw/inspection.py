"""What a log holds and what each of its columns is likely to be, from names, units and numbers."""

from __future__ import annotations

import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.clock import Stamps, read_stamps
from bayes_hw.errors import InputError
from bayes_hw.following import following, relation
from bayes_hw.formats.header import is_time_name, split_name, unit_of
from bayes_hw.formats.readers import read_table
from bayes_hw.formats.table import Table
from bayes_hw.inspection_mends import after_findings, arguments, findings_of, mended, units_to_ask_for
from bayes_hw.log_columns import cut_stamps
from bayes_hw.reading_options import Columns, ReadingOptions
from bayes_hw.record import Record
from bayes_hw.record_checks import Finding, wrapped_angle
from bayes_hw.resample import MOST_SAMPLES
from bayes_hw.time_stamps import rate_of_cut_stamps

MOST_COLUMNS = 24
"""Columns that are compared with each other."""

COMMAND_WORDS = (
    *("cmd", "command", "demand", "dem", "setpoint", "set", "target", "ref", "reference", "input", "desired"),
    *("commanded", "vir", "voltage"),
)
OUTPUT_WORDS = (
    *(
        "actual",
        "act",
        "meas",
        "measured",
        "enc",
        "encoder",
        "angle",
        "output",
        "pos",
        "position",
        "az",
        "el",
    ),
    *("feedback", "fb"),
)
SPEED_WORDS = ("vel", "rate", "speed")
NAME_BONUS = 0.3
AMBIGUOUS = 0.05
FOLLOWS = 0.5

CLOCK_NAME = re.compile(r"(^|[_. ])(t|time|timestamp|stamp|clock)([_. ]|$)|time$", re.IGNORECASE)
"""Names of columns that may be the clock of a signal."""

RELATED = {"follows": 1.0, "inverted": 1.0, "derivative": 0.8}
"""What a correlation counts where the angle is so related to the command; an output that is a speed moves as
a derivative."""

POSITION_GAINS = (0.1, 3.0)
"""Output speed over the speed of a command that is a position."""


@dataclass(frozen=True)
class ColumnFacts:
    """One column: extent, empty cells, step of its readings (None where there is none), unit."""

    name: str
    unit: str | None
    values: FloatArray
    empty: int
    step: float | None
    wraps: str


@dataclass(frozen=True)
class Inspection:
    """What was found: lines to read, the options that read the file, None where a choice is open, and the
    questions that are, each naming the option that answers it."""

    lines: tuple[str, ...]
    options: ReadingOptions | None
    arguments: tuple[str, ...]
    questions: tuple[str, ...]
    records: tuple[Record, ...]

    def command(self, path: Path, name: str = "convert", out: str = "record.csv") -> str:
        """The exact command line."""
        return shlex.join(["bayes-hw", name, str(path), *self.arguments, "--out", out])


def inspect_file(path: Path, given: ReadingOptions | None = None) -> Inspection:
    """Look at a file; roles that `given` names other than by default are taken as they are.

    Raises InputError where the file cannot be read as a table at all.
    """
    table = _whole(path)
    options = given or ReadingOptions()
    lines = [f"{path}: {len(table.names)} {table.kind}s, {_rows(table)} rows", *table.said]
    clock, clock_name, why = _clock(table, options)
    facts = [_facts(name, table, table.values[name]) for name in table.values if name != clock_name]
    if clock_name is not None and clock is not None:
        lines.append(f"  {clock_name!r}: the clock ({why}); {clock.said or 'numbers in s'}")
    lines += [_line(each) for each in facts]
    for joined in options.join:
        more, said = _joined(joined, clock, options)
        facts += more
        lines += said
    rate = _rate(clock, options)
    questions: list[str] = []
    if rate is None:
        questions.append(_no_clock(table, options))
        return Inspection(tuple(lines), None, (), tuple(questions), ())
    options = replace(options, columns=replace(options.columns, time=clock_name))
    options, sentences, questions = _roles(facts, rate, options, given or ReadingOptions())
    lines += sentences
    if not questions and options.output_time is None and clock is not None:
        options, sentences = _second_clock(table, clock, options)
        lines += sentences
    if questions:
        return Inspection(tuple(lines), None, (), tuple(questions), ())
    return _tried(path, options, lines)


def _joined(path: Path, base: Stamps | None, options: ReadingOptions) -> tuple[list[ColumnFacts], list[str]]:
    """The columns of a file to be joined, at the stamps of the record's own clock."""
    table = _whole(path)
    clock, clock_name, why = _clock(table, options)
    facts = [_facts(name, table, table.values[name]) for name in table.values if name != clock_name]
    lines = [f"{path}: {len(table.names)} {table.kind}s, {_rows(table)} rows", *table.said]
    if clock is None or base is None:
        return [], [*lines, *map(_line, facts)]
    lines += [f"  {clock_name!r}: the clock ({why}); {clock.said or 'numbers in s'}", *map(_line, facts)]
    origin = clock.origin_ns if clock.origin_ns is not None else 0
    when = clock.seconds + (0.0 if base.origin_ns is None else (origin - base.origin_ns) / 1e9)
    at = [
        replace(each, values=np.interp(base.seconds, when, _filled(each.values)))
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
            units={name: unit for table in found.values() for name, unit in table.units.items()},
        )


def _numbers_in_text(path: Path, table: Table) -> Table:
    """With the columns of text that are no stamps read as numbers, such as sexagesimal angles, where all
    their cells are."""
    text = [name for name, values in table.values.items() if values.dtype.kind in "UO"]
    for name in text:
        if is_time_name(name):
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


def _rows(table: Table) -> int:
    return max((len(values) for values in table.values.values()), default=0)


def _clock(table: Table, options: ReadingOptions) -> tuple[Stamps | None, str | None, str]:
    """The column of time stamps: the one named, else by its name, else the first that increases evenly."""
    asked = options.columns.time
    names = list(table.values)
    if asked is not None and asked != Columns.time and asked in names:
        return _stamps(table, asked), asked, "named"
    named = [name for name in names if is_time_name(name)]
    for name in [*([asked] if asked in names else []), *named]:
        assert name is not None
        stamps = _stamps(table, name)
        if stamps is not None and _increases(stamps.seconds):
            return stamps, name, "by its name"
    for name in names:
        stamps = _stamps(table, name)
        if stamps is not None and _increases(stamps.seconds) and _is_even(stamps.seconds):
            return stamps, name, "it increases evenly"
    return None, None, ""


def _second_clock(table: Table, clock: Stamps, options: ReadingOptions) -> tuple[ReadingOptions, list[str]]:
    """The clock of the output, where one of its own stands before it in the table."""
    names = list(table.values)
    output = next((name for name in names if split_name(name)[0] == options.columns.output), None)
    if output is None or options.columns.time is None:
        return options, []
    for name in reversed(names[: names.index(output)]):
        if name == options.columns.time:
            break
        stamps = _stamps(table, name) if CLOCK_NAME.search(name) else None
        if stamps is None or not (_increases(stamps.seconds) and _is_even(stamps.seconds)):
            continue
        if len(stamps.seconds) == len(clock.seconds) and np.array_equal(stamps.seconds, clock.seconds):
            continue
        return replace(options, output_time=name), [f"clock of {output!r}: {name!r}, one of its own"]
    return options, []


def _no_clock(table: Table, options: ReadingOptions) -> str:
    """What is asked where no column is a clock."""
    if _rows(table) < 4:
        return f"holds {_rows(table)} rows of data; give a log with samples"
    asked = options.columns.time
    named = [name for name in table.values if name == asked or is_time_name(name)]
    if named:
        try:
            seconds = read_stamps(table.values[named[0]], named[0], table.units.get(named[0])).seconds
        except InputError as error:
            return f"which column is the clock? {named[0]!r}: {error}"
        cut = rate_of_cut_stamps(seconds[np.isfinite(seconds)])
        if cut is not None:
            return cut_stamps(cut)
    why = f" {named[0]!r} holds no stamps that increase;" if named else ""
    return f"which column is the clock?{why} give --time NAME, or --time none --sample-rate HZ"


def _stamps(table: Table, name: str) -> Stamps | None:
    try:
        return read_stamps(table.values[name], name, table.units.get(name))
    except InputError:
        return None


def _increases(t: FloatArray) -> bool:
    """Or, the newest standing first, decreases."""
    steps = np.diff(t[np.isfinite(t)])
    return len(steps) > 2 and max(float(np.mean(steps > 0)), float(np.mean(steps < 0))) > 0.9


def _is_even(t: FloatArray) -> bool:
    steps = np.diff(t[np.isfinite(t)])
    median = float(np.median(steps))
    return median > 0 and float(np.mean(np.abs(steps - median) < median / 3)) > 0.8


def _rate(clock: Stamps | None, options: ReadingOptions) -> float | None:
    if clock is None:
        return options.sample_rate_hz
    step = abs(float(np.nanmedian(np.diff(clock.seconds))))
    return 1 / step if step > 0 else None


def _facts(name: str, table: Table, values: FloatArray) -> ColumnFacts:
    if values.dtype.kind in "UO":
        return ColumnFacts(name, None, np.zeros(0), len(values), None, "")
    numbers = np.asarray(values, dtype=np.float64)
    shown = numbers[np.isfinite(numbers)]
    wrapped = wrapped_angle(shown) if len(shown) > 3 else None
    return ColumnFacts(
        name,
        table.units.get(name) or unit_of(name),
        numbers,
        len(numbers) - len(shown),
        quantisation_step(shown),
        "" if wrapped is None else wrapped.remedy,
    )


def quantisation_step(values: FloatArray) -> float | None:
    """The step of which all readings, shape (samples,), are whole multiples apart; None where there is
    none."""
    distinct = np.unique(values[: 2**17])
    if len(distinct) < 3:
        return None
    step = float(np.diff(distinct).min())
    counts = (distinct - distinct[0]) / step
    if step <= 0 or counts[-1] > 2**40 or np.abs(counts - np.rint(counts)).max() > 0.05:
        return None
    return float(f"{float(distinct[-1] - distinct[0]) / float(np.rint(counts[-1])):.6g}")


def _line(facts: ColumnFacts) -> str:
    shown = facts.values[np.isfinite(facts.values)]
    if len(shown) == 0:
        return f"  {facts.name!r}: text, or nothing"
    words = [f"  {facts.name!r}: {shown.min():.6g} to {shown.max():.6g}"]
    words.append(facts.unit if facts.unit else "no unit stated")
    if facts.step is not None:
        words.append(f"readings in steps of {facts.step:.3g}")
    if facts.empty:
        words.append(f"{facts.empty} empty")
    if np.ptp(shown) == 0:
        words.append("constant")
    if facts.wraps:
        words.append(f"wraps: {facts.wraps}")
    return ", ".join(words)


def _roles(
    facts: Sequence[ColumnFacts], rate: float, options: ReadingOptions, given: ReadingOptions
) -> tuple[ReadingOptions, list[str], list[str]]:
    """Command and output among the columns: the pair that names and numbers speak for."""
    usable = [each for each in facts if _moves(each)][:MOST_COLUMNS]
    names = {each.name: each for each in usable}
    bare = {split_name(name)[0]: name for name in names}
    named_input = given.input_position or (given.columns.input if given.columns.input != "u" else None)
    named_output = given.columns.output if given.columns.output != "y" else None
    inputs = [bare.get(named_input, named_input)] if named_input else list(names)
    outputs = [bare.get(named_output, named_output)] if named_output else list(names)
    scored = sorted(
        (
            (score, is_position, u, y)
            for u in inputs
            for y in outputs
            if u in names and y in names and u != y
            for score, is_position in [_score(names[u], names[y], rate)]
        ),
        reverse=True,
    )
    if not scored or scored[0][0] < FOLLOWS:
        return options, [], [_no_pair(facts, list(names))]
    _, is_position, u, y = best = scored[0]
    rival = next((other for other in scored[1:] if other[0] > best[0] - AMBIGUOUS), None)
    if rival is not None and rival[2:] != (u, y):
        option, one, two = ("--input", u, rival[2]) if rival[2] != u else ("--output", y, rival[3])
        if option == "--input" and is_position != rival[1]:
            one, two = (
                f"--input{'-position' if is_position else ''} {u}",
                f"--input{'-position' if rival[1] else ''} {two}",
            )
            return options, [], [f"is the command velocity or position? give {one} or {two}"]
        return options, [], [f"which column? both follow alike: give {option} {one!r} or {option} {two!r}"]
    word = _chosen_words(names[u], names[y], rate, is_position)
    columns = replace(
        options.columns, input="u" if is_position else split_name(u)[0], output=split_name(y)[0]
    )
    chosen = replace(options, columns=columns, input_position=split_name(u)[0] if is_position else None)
    return chosen, [word], []


def _no_pair(facts: Sequence[ColumnFacts], moving: Sequence[str]) -> str:
    """What is asked where no two columns are command and output."""
    still = [each for each in facts if each.name not in moving]
    words = [f"{each.name!r} {_why_still(each)}" for each in still[:4]]
    if len(moving) == 1:
        words.append(f"{moving[0]!r} alone moves")
        remedy = "where the other signal is in another file, give --join FILE and --input NAME, --output NAME"
    elif moving:
        words.append("no output follows a command clearly")
        remedy = f"give --input NAME and --output NAME, of {', '.join(map(repr, moving))}"
    else:
        remedy = "give a log of an axis that moves"
    if not words:
        return "which columns are command and output? several have the same name: give each one of its own"
    return f"which columns are command and output? {'; '.join(words)}: {remedy}"


def _why_still(facts: ColumnFacts) -> str:
    shown = facts.values[np.isfinite(facts.values)]
    if len(shown) == 0:
        return "is text or empty"
    if np.ptp(shown) == 0:
        return f"is {shown[0]:.6g} throughout"
    return f"has {len(shown)} numbers, too few"


def _chosen_words(u: ColumnFacts, y: ColumnFacts, rate: float, is_position: bool) -> str:
    """The pair taken, and how far its numbers speak for it."""
    length = min(len(u.values), len(y.values))
    command, angle = _filled(u.values[:length]), _filled(y.values[:length])
    if is_position:
        command, angle = np.diff(command) * rate, angle[:-1]
    found = following(command, angle, rate)
    how = "a position" if is_position else "a velocity"
    size = 0.0 if found is None else found.correlation
    said = f"command: {u.name!r}, {how}; output: {y.name!r}; its speed follows with correlation {size:.2f}"
    by_name = "" if abs(size) > FOLLOWS else ", so by their names alone"
    return said + by_name


def _moves(facts: ColumnFacts) -> bool:
    shown = facts.values[np.isfinite(facts.values)]
    return len(shown) > 100 and float(np.ptp(shown)) > 0


def _score(u: ColumnFacts, y: ColumnFacts, rate: float) -> tuple[float, bool]:
    """How well `y` follows `u`, by numbers and names, and whether `u` is then a position."""
    length = min(len(u.values), len(y.values))
    command, angle = _filled(u.values[:length]), _filled(y.values[:length])
    names = NAME_BONUS * (_has(u.name, COMMAND_WORDS, "u") + _has(y.name, OUTPUT_WORDS, "y"))
    names -= NAME_BONUS * (_has(u.name, OUTPUT_WORDS, "y") * (1 - _has(u.name, COMMAND_WORDS, "u")))
    names -= NAME_BONUS * _has(y.name, COMMAND_WORDS, "u")
    forward = following(command, angle, rate)
    related = relation(command, angle, rate)
    speed = 0.0 if forward is None else RELATED.get(related, 0.0) * forward.correlation
    of_speed = following(np.diff(command) * rate, angle[:-1], rate) if related == "derivative" else None
    is_position = (
        of_speed is not None and of_speed.is_forward and POSITION_GAINS[0] < of_speed.gain < POSITION_GAINS[1]
    )
    same = 0.0 if of_speed is None or not is_position else of_speed.correlation
    if any(word in u.name.casefold() for word in SPEED_WORDS):
        names += NAME_BONUS / 2
    if any(word in y.name.casefold() for word in SPEED_WORDS):
        names -= NAME_BONUS
    if is_position and not _has(u.name, COMMAND_WORDS, "u"):
        names -= NAME_BONUS
    return max(same if is_position else 0.0, speed) + names, is_position


def _has(name: str, words: Sequence[str], letter: str) -> bool:
    bare = split_name(name)[0].casefold()
    return bare == letter or any(word in bare for word in words)


def _filled(values: FloatArray) -> FloatArray:
    shown = np.flatnonzero(np.isfinite(values))
    return np.interp(np.arange(len(values)), shown, values[shown])


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
                return Inspection(tuple(lines), None, (), (message,), ())
            tried.append(message)
            lines.append(message.removeprefix(f"{path}: "))
            options = better
            continue
        better, sentence = after_findings(found, options)
        if better is None or sentence in tried:
            break
        tried.append(sentence)
        lines.append(sentence)
        options = better
    else:
        return Inspection(tuple(lines), None, (), (tried[-1],), ())
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
    return Inspection(tuple(lines), options, arguments(options), questions, tuple(records))


def _named(record: Record, finding: Finding, records: Sequence[Record]) -> str:
    """The finding, with the name of the part that shows it where there are several."""
    return str(finding) if len(records) == 1 else f"{record.name}: {finding}"
