"""Tables in long form: a stamp, the name of a signal and its value a row, signals by turns.

They become one column a signal. Wickham, "Tidy data" (2014, doi 10.18637/jss.v059.i10), calls it molten.

Reading InfluxDB's annotated CSV: tables one below the other, one row a value, fields under `_field`.

Source: InfluxData, "Annotated CSV", annotations #datatype, #group and #default.
"""

from __future__ import annotations

import csv
import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.csv_file import rows_of_csv, stamps_of
from bayes_hw.formats.header import is_time_name, matches
from bayes_hw.formats.table import Column, Table
from bayes_hw.formats.text_layout import MISSING, NUMBER, number_of

Fields: TypeAlias = Mapping[str, tuple[Sequence[str], Sequence[str]]]
"""Of every signal its stamps and its values, as the file has them."""

MOST_COLUMNS, MOST_SIGNALS = 8, 64
HEAD_ROWS, FEWEST_ROWS = 400, 12
BY_TURNS = 0.3
"""Share of the rows whose name is not that of the row before, from which a table is long: the state of an
axis changes rarely."""


@dataclass(frozen=True)
class LongColumns:
    """Where in a row of a long table stamp, name and value stand, and what separates them."""

    time: int
    name: int
    value: int
    header: tuple[str, ...]
    separator: str


def long_columns(path: Path) -> LongColumns | None:
    """How a text file is a long table, None where it is none."""
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            first = stream.readline(4096)
            separator = max(",;\t", key=first.count)
            header = tuple(cell.strip() for cell in next(csv.reader([first], delimiter=separator), []))
            if not 3 <= len(header) <= MOST_COLUMNS:
                return None
            lines = itertools.islice(stream, HEAD_ROWS)
            rows = [row for row in csv.reader(lines, delimiter=separator) if len(row) == len(header)]
    except (UnicodeDecodeError, csv.Error):
        return None
    clocks = [i for i, cell in enumerate(header) if is_time_name(cell)]
    if len(clocks) != 1 or len(rows) < FEWEST_ROWS:
        return None
    others = [i for i in range(len(header)) if i not in clocks]
    numeric = [i for i in others if all(_is_number(row[i]) for row in rows)]
    names = [i for i in others if i not in numeric and _by_turns([row[i] for row in rows])]
    if len(numeric) != 1 or len(names) != 1:
        return None
    return LongColumns(clocks[0], names[0], numeric[0], header, separator)


def read_long(
    path: Path, at: LongColumns, wanted: Sequence[str], *, most_rows: int, text: Collection[str] = ()
) -> Table:
    """Read the signals that `wanted` names as columns; raises InputError on a value that is no number."""
    fields: dict[str, tuple[list[str], list[str]]] = {}
    for row in itertools.islice(rows_of_csv(path, at.separator), 1, None):
        if len(row) != len(at.header):
            continue
        stamps, values = fields.setdefault(row[at.name].strip(), ([], []))
        if len(fields) > MOST_SIGNALS:
            raise InputError(
                f"{path}: column {at.header[at.name]!r} names more than {MOST_SIGNALS} signals; select those "
                "of the record"
            )
        if len(values) < most_rows:
            stamps.append(row[at.time].strip())
            values.append(row[at.value].strip())
    said = f"a signal a row: {at.header[at.name]!r} names it, {at.header[at.value]!r} is its value"
    return table_of_fields(path, at.header[at.time], fields, wanted, text, (said,))


def table_of_fields(
    path: Path,
    time: str,
    fields: Fields,
    wanted: Sequence[str],
    text: Collection[str],
    said: tuple[str, ...] = (),
) -> Table:
    """Signals as columns; where all have the same stamps these are the column `time`, and what any name of
    `text` that no signal has means; else every one has its own.

    Raises InputError on a value of a signal that is no finite number, but of those of `text`.
    """
    names = list(fields)
    stamps = [given for given, _ in fields.values()]
    shared = all(given == stamps[0] for given in stamps[1:])
    values: dict[str, Column] = {}
    clocks: dict[str, Column] = {}
    for name in wanted:
        found = matches(names, name)
        if found:
            own, cells = fields[names[found[0]]]
            values[name] = _column(path, name, cells, name in text)
            if not shared:
                clocks[name] = stamps_of(np.array(own, dtype=np.str_))
        elif shared and stamps and (name in text or name == time) and name != "\0":
            values[name] = stamps_of(np.array(stamps[0], dtype=np.str_))
    missing = tuple(name for name in wanted if name not in values and (shared or name not in text))
    return Table(
        values, missing, (time, *names), "column", lambda index: f"sample {index + 1}", {}, clocks, said=said
    )


def _is_number(cell: str) -> bool:
    return cell.strip().lower() in MISSING or NUMBER.fullmatch(cell.strip()) is not None


def _by_turns(cells: Sequence[str]) -> bool:
    changes = np.mean([one != other for one, other in itertools.pairwise(cells)])
    return 2 <= len(set(cells)) <= MOST_SIGNALS and bool(changes >= BY_TURNS) and "" not in cells


def _column(path: Path, name: str, cells: Sequence[str], is_text: bool) -> Column:
    found = np.empty(len(cells))
    for i, cell in enumerate(cells):
        if cell.lower() in MISSING:
            found[i] = np.nan
        elif NUMBER.fullmatch(cell) and np.isfinite(number_of(cell)):
            found[i] = number_of(cell)
        elif is_text:
            return np.array(cells, dtype=np.str_)
        else:
            raise InputError(
                f"{path}: field {name!r}, value {i + 1}: {cell[:40]!r} is not a finite number; correct it"
            )
    return found


ANNOTATIONS = ("#datatype", "#group", "#default")
TIME, FIELD, VALUE = "_time", "_field", "_value"


def is_annotated(path: Path) -> bool:
    """Whether a text file begins with annotations, or with the header that follows them."""
    with path.open("rb") as stream:
        head = stream.read(400).decode("utf-8", "replace").lstrip("\ufeff\r\n")
    first = head.splitlines()[0] if head.splitlines() else ""
    return first.startswith(ANNOTATIONS) or (first.startswith(",result,table") and TIME in first)


def read_annotated(path: Path, wanted: Sequence[str], *, most_rows: int, text: Collection[str] = ()) -> Table:
    """Read the fields, or columns, that `wanted` names, as `table_of_fields` has them.

    Any name of a clock means the column `_time`. Raises InputError on a value that is no number, OSError
    where the file cannot be read.
    """
    fields: dict[str, tuple[list[str], list[str]]] = {}
    header: list[str] = []
    for cells in rows_of_csv(path):
        if not any(cells) or cells[0].startswith("#"):
            header = []
        elif not header:
            header = cells
            if TIME not in header:
                raise InputError(f"{path}: its table has no column {TIME!r}; query with one")
        else:
            _take(header, cells, fields, most_rows)
    return table_of_fields(path, TIME, fields, wanted, text)


def _take(
    header: Sequence[str],
    cells: Sequence[str],
    fields: dict[str, tuple[list[str], list[str]]],
    most_rows: int,
) -> None:
    row = dict(zip(header, cells, strict=False))
    stamp = row.get(TIME, "")
    if FIELD in row:
        shown = {row[FIELD]: row.get(VALUE, "")}
    else:
        skipped = ("", "result", "table", TIME, "_start", "_stop", "_measurement")
        shown = {name: cell for name, cell in row.items() if name not in skipped}
    for name, cell in shown.items():
        stamps, values = fields.setdefault(name, ([], []))
        if len(values) < most_rows:
            stamps.append(stamp)
            values.append(cell)
