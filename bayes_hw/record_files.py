"""Reading records from files of every format, refusing what cannot be one."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.column_roles.found_columns import found_options, may_be_found
from bayes_hw.column_roles.whole_table import whole_table, with_own_clocks
from bayes_hw.errors import InputError
from bayes_hw.formats.readers import read_table
from bayes_hw.formats.split_seconds import with_split_clocks
from bayes_hw.formats.table import Table
from bayes_hw.log.log_columns import LogColumns, log_columns
from bayes_hw.log.resample import MOST_SAMPLES
from bayes_hw.quantities import conversion, spelt, with_step
from bayes_hw.reading_options import Columns, ReadingOptions
from bayes_hw.record_checks import wrapped_angle
from bayes_hw.record_parts import FEWEST_SAMPLES, Part, cut_into_parts
from bayes_hw.record_start import reading_noise
from bayes_hw.units import Units

__all__ = ["Columns", "FileContent", "ReadingOptions", "read_parts"]

MOST_BYTES = 512 * 2**20

LARGEST_VALUE = 1e12
"""A value beyond is a glitch of the log, and overflows when squared and summed."""

LEAST_CHANGE = 1e-14
"""A column that changes by no more than this times its largest value or 1 is constant."""


class FileContent(NamedTuple):
    """What a file holds of a record: columns (samples,), rate, which outputs were measured, known signals,
    digest, what was done to them, and the units by role ("input", "output") that they are in, as far as file
    or options state them; `clock` and `options` as in `bayes_hw.record.Record`."""

    t: FloatArray
    u: FloatArray
    y: FloatArray
    sample_rate_hz: float
    measured: BoolArray | None
    known: Mapping[str, FloatArray]
    sha256: str
    treatment: tuple[str, ...]
    units: Mapping[str, str]
    known_units: Mapping[str, str]
    level_sd: float = 0.0
    clock: str = "s"
    options: ReadingOptions = ReadingOptions()


def asked_options(
    options: ReadingOptions | None,
    columns: Columns | None,
    sample_rate_hz: float | None,
    resample_hz: float | None,
    units: Units | Mapping[str, str] | None,
) -> ReadingOptions:
    """The options with what is said beside them."""
    chosen = options or ReadingOptions()
    given = units.to_dict() if isinstance(units, Units) else dict(units or {})
    return replace(
        chosen,
        columns=columns or chosen.columns,
        sample_rate_hz=chosen.sample_rate_hz if sample_rate_hz is None else sample_rate_hz,
        resample_hz=chosen.resample_hz if resample_hz is None else resample_hz,
        units={**chosen.units, **given},
    )


def read_parts(path: Path, options: ReadingOptions) -> list[FileContent]:
    """Read the record, or the records that its gaps make of it, from the file at `path`.

    The format is that of the file's ending; see `formats.readers`. Columns that are not named, and are not
    there as t, u and y, are found by names and numbers where these leave no choice. Stamps of a uniform rate,
    also with jitter below a third of a step, make a record. Rows that repeat are dropped. Missing samples are
    refused unless `options.gaps` or `options.resample_hz` says what becomes of them.

    Raises InputError, naming the file, the row or column, and the remedy, on anything that is not a record:
    fewer than 32 or more than 10,000,000 samples, a missing column, a cell that is not a finite number or is
    beyond 1e12, stamps that go back or repeat with other values, a constant command or output, an angle that
    jumps by a whole turn.
    """
    options = _checked(options)
    if options.columns.time is None and options.sample_rate_hz is None:
        raise InputError(f"{path}: no time column is named; give --sample-rate RATE in Hz")
    tables, digest = _tables(path, options)
    said: tuple[str, ...] = ()
    if may_be_found(lacking := _lacking(tables, options), options):
        options, said = found_options(
            path, whole_table(path), partial(with_own_clocks, path), options, lacking
        )
        tables, digest = _tables(path, options)
    return _of_tables(path, tables, options, digest, said)


def _tables(path: Path, options: ReadingOptions) -> tuple[list[tuple[Path, Table]], str]:
    """The columns of the record's own file, which is the first, and of those joined to it; the digest."""
    columns, wanted = options.columns, options.wanted
    if len(set(wanted.values())) < len(wanted):
        raise InputError(
            f"{path}: one column is named twice among {', '.join(map(repr, wanted.values()))}; "
            "give --time, --input and --output different names"
        )
    with _os_errors(path):
        digest = _digest(path)
        tables: list[tuple[Path, Table]] = []
        names = [*wanted.values(), *options.known]
        clocks = [name for name in (columns.time, options.output_time) if name is not None]
        if options.output_time is not None:
            names.append(options.output_time)
        same = [options.clock_offset] if options.clock_offset is not None and options.join else []
        own = list(dict.fromkeys([*names, *same]))
        tables.append((path, _present(path, own, clocks, options)))
    for other in options.join:
        absent = [name for name in names if name not in tables[0][1].values or name in clocks]
        with _os_errors(other):
            _digest(other)
            tables.append((other, _present(other, list(dict.fromkeys([*absent, *same])), clocks, options)))
    return tables, digest


def _lacking(tables: Sequence[tuple[Path, Table]], options: ReadingOptions) -> list[str]:
    """The roles whose column no table holds; an output that need not be there is not lacking."""
    table = tables[0][1]
    wanted = options.wanted
    held = {name for _, each in tables for name in each.values}
    if not held:
        held = set(wanted.values()) - {name for _, each in tables for name in each.missing}
    found = [role for role, name in wanted.items() if name not in held]
    if "time" in found and wanted["input"] in table.clocks:
        found.remove("time")
    if found == ["output"] and not options.needs_output:
        return []
    return found


def _checked(options: ReadingOptions) -> ReadingOptions:
    """The options with units that are some; raises InputError where one is not."""
    given = Units.from_dict(dict(options.units)).to_dict()
    asked = {role: given[role] for role in ("input", "output") if role in options.units}
    return replace(options, units=asked)


def parts_of_table(path: Path, table: Table, options: ReadingOptions) -> list[FileContent]:
    """The same of a table in memory, which `path` stands for in what is said."""
    options = _checked(options)
    table = with_split_clocks(table)
    said: tuple[str, ...] = ()
    if may_be_found(lacking := _lacking([(path, table)], options), options):
        options, said = found_options(path, table, lambda held: held, options, lacking)
    return _of_tables(path, [(path, table)], options, "", said)


def _of_tables(
    path: Path,
    tables: Sequence[tuple[Path, Table]],
    options: ReadingOptions,
    digest: str,
    said: tuple[str, ...] = (),
) -> list[FileContent]:
    log = log_columns(tables, options)
    log = replace(log, said=(*said, *log.said))
    if len(log.t) < FEWEST_SAMPLES:
        raise InputError(
            f"{path}: has {len(log.t)} samples of the {FEWEST_SAMPLES} that a record needs; give a longer one"
        )
    if len(log.t) > MOST_SAMPLES:
        raise InputError(f"{path}: has more than {MOST_SAMPLES:,} samples; cut the record into parts")
    _check_values(path, log, options)
    parts = cut_into_parts(path, log, options)
    contents = [
        _content(path, part, log, options, digest)._replace(clock=log.clock, options=options)
        for part in parts
    ]
    if options.unwrap is not None:
        contents = [content._replace(level_sd=reading_noise(content.y)) for content in contents]
    return _those_that_move(path, contents, log, options)


def _present(path: Path, names: Sequence[str], clocks: Sequence[str], options: ReadingOptions) -> Table:
    """The columns of `names` that a file holds, where others may hold the rest; else all or none."""
    table = read_table(path, names, clocks, most_rows=MOST_SAMPLES + 1)
    may_lack = options.join or (not options.needs_output and options.columns.output == Columns.output)
    if table.missing and not table.values and may_lack:
        held = [name for name in names if name not in table.missing]
        if held:
            return read_table(path, held, clocks, most_rows=MOST_SAMPLES + 1)
    return table


def _content(path: Path, part: Part, log: LogColumns, options: ReadingOptions, digest: str) -> FileContent:
    """A part in the units asked for, unwrapped, its command a velocity."""
    said = [*log.said, *part.said]
    units: dict[str, str] = {}
    stated = {} if options.ignore_units else log.units
    u, y = (part.u, part.y) if options.unwrap is None else _without_turns(path, part, log, options)
    known_units = {name: log.units[name] for name in part.known if name in log.units}
    for role in ("input", "output"):
        is_position = role == "input" and options.input_position is not None
        factor, unit, sentence = _in_unit(path, role, stated.get(role), options.units.get(role), is_position)
        if unit is not None:
            units[role] = unit
        if factor != 1.0:
            said.append(sentence)
            if role == "input":
                u = u * factor
            else:
                y = y * factor
    if options.unwrap is not None and part.has_output:
        said.append(f"angle unwrapped at {options.unwrap:g} and counted from its first value, {y[0]:.9g}")
        y = y - y[0]
    elif part.has_output:
        _refuse_wrap(path, part, log, part.y)
    if options.reverse:
        y = -y
        said.append("output taken with the other sign")
    if options.input_position is None:
        return FileContent(
            part.t, u, y, part.rate_hz, part.measured, part.known, digest, tuple(said), units, known_units
        )
    said.append(
        f"command: forward difference of the position {options.input_position!r}; the last sample, which "
        "has none, "
        "left out"
    )
    known = {name: values[:-1] for name, values in part.known.items()}
    measured = None if part.measured is None else part.measured[:-1]
    speed = np.diff(u) * part.rate_hz
    return FileContent(
        part.t[:-1], speed, y[:-1], part.rate_hz, measured, known, digest, tuple(said), units, known_units
    )


def _in_unit(
    path: Path, role: str, stated: str | None, wanted: str | None, is_position: bool
) -> tuple[float, str | None, str]:
    """What to multiply a column by, the unit that it is then in, None where nobody says, and what to say."""
    if is_position and stated is not None:
        stated = f"({stated})/s" if not stated.replace("°", "d").isalpha() else f"{stated}/s"
    if stated is None:
        if wanted is None:
            return 1.0, None, ""
        step, unit = with_step(wanted)
        return step, unit, f"{role}: each count taken as {wanted}"
    if wanted is None:
        step, unit = with_step(stated)
        return step, spelt(unit), f"{role} stated in {stated!r}: multiplied by {step:g}"
    try:
        factor = conversion(stated, wanted)
    except InputError as error:
        raise InputError(f"{path}: its {role}: {error}; correct --{role}-unit or the file") from None
    return factor, with_step(wanted)[1], f"{role} converted from {stated} to {wanted}"


def _without_turns(
    path: Path, part: Part, log: LogColumns, options: ReadingOptions
) -> tuple[FloatArray, FloatArray]:
    """Command and angle, in the units of the file, without jumps by a turn; where the angle was not measured,
    between its neighbours. Raises InputError where it jumps by another turn still."""
    turn = options.unwrap or 0.0
    u = part.u if options.input_position is None else np.unwrap(part.u, period=turn)
    if not part.has_output:
        return u, part.y
    shown = np.flatnonzero(part.measured_samples)
    y = np.interp(np.arange(len(part.y)), shown, np.unwrap(part.y[shown], period=turn))
    _refuse_wrap(path, part, log, y)
    return u, y


def _refuse_wrap(path: Path, part: Part, log: LogColumns, y: FloatArray) -> None:
    """Raise InputError where the angle, shape (samples,), jumps by a turn."""
    rows = np.flatnonzero(part.measured_samples)
    fault = wrapped_angle(y[rows])
    if fault is not None:
        raise InputError(f"{path}: {log.place_of(part.row_of(int(rows[fault.first])))}: {fault}")


def _those_that_move(
    path: Path, contents: Sequence[FileContent], log: LogColumns, options: ReadingOptions
) -> list[FileContent]:
    """The parts whose command and output change; raises InputError where none does."""
    kept, fault = [], ""
    for content in contents:
        role = _constant(content)
        if role is None:
            kept.append(content)
        elif not fault:
            value = float(content.u[0] if role == "input" else content.y[0])
            fault = (
                f"{path}: {log.kind} {options.wanted[role]!r} is {value:g} throughout, which shows "
                f"nothing of the axis; give a record that moves, or map another with --{role} NAME"
            )
    if not kept:
        raise InputError(fault)
    dropped = len(contents) - len(kept)
    if dropped:
        word = f"{dropped} parts left out in which nothing moves"
        kept = [content._replace(treatment=(*content.treatment, word)) for content in kept]
    return kept


def _constant(content: FileContent) -> str | None:
    has_output = content.measured is None or bool(content.measured.any())
    for role, values in (("input", content.u), ("output", content.y)):
        if role == "output" and not has_output:
            continue
        if np.ptp(values) <= LEAST_CHANGE * max(float(np.abs(values).max()), 1.0):
            return role
    return None


def _check_values(path: Path, log: LogColumns, options: ReadingOptions) -> None:
    columns = {"time": log.t, "input": log.u} | ({} if log.y is None else {"output": log.y})
    for role, values in columns.items():
        sizes = np.where(np.isfinite(values), np.abs(values), 0.0)
        largest = int(sizes.argmax())
        if sizes[largest] > LARGEST_VALUE:
            missing = f", or, where it means nothing, --missing {values[largest]:.15g}"
            raise InputError(
                f"{path}: {log.place_of(largest)}, {log.kind} {options.wanted.get(role, role)!r}: "
                f"{values[largest]:g} is beyond {LARGEST_VALUE:g}; correct it, or give the {role} in a "
                "larger unit" + (", such as --time-unit ms" if role == "time" else missing)
            )


@contextmanager
def _os_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); check the path") from None
    except ValueError as error:  # a name that no file can have
        raise InputError(f"{str(path)!r}: cannot be read ({error}); check the path") from None


def checked_file(path: Path) -> str:
    """The digest of a file; raises InputError where it is none, or cannot be read."""
    with _os_errors(path):
        return _digest(path)


def _digest(path: Path) -> str:
    """SHA-256 of the file; refuses what is not a file, is empty, or is too large."""
    if path.is_dir():
        if (path / "metadata.yaml").is_file():
            return _digest(path / "metadata.yaml")
        raise InputError(f"{path}: is a directory; give a CSV, .mat, .h5 or .parquet file")
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: is not a regular file; give a CSV, .mat, .h5 or .parquet file")
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{path}: is empty; give a record with a header and rows")
    if size > MOST_BYTES:
        raise InputError(
            f"{path}: {size / 2**20:.0f} MB is more than the {MOST_BYTES // 2**20} MB that are read; "
            "cut the record into parts"
        )
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
