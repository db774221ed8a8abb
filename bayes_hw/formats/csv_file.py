"""Reading columns from tables in text, with whatever separator, decimal sign, header and comments."""

from __future__ import annotations

import csv
import itertools
import math
import re
import warnings
from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.grouped_digits import GROUPED, without_groups
from bayes_hw.formats.header import is_time_name, matches, quantity_of
from bayes_hw.formats.table import Column, Table
from bayes_hw.formats.text_layout import (
    COMMENTS,
    MISSING,
    NUMBER,
    Layout,
    cells_of,
    find_layout,
    is_value,
    number_of,
)
from bayes_hw.formats.torn_row import ends_torn

LONGEST_LINE = 2**20
ROWS_AT_ONCE = 2**16
LONGEST_EXACT = 15
"""Digits of a whole number that a float holds exactly."""


def read_csv(path: Path, wanted: Sequence[str], *, most_rows: int, text: Collection[str] = ()) -> Table:
    """Read the columns that `wanted` names, at most `most_rows` rows, from a table in text.

    Layout by `find_layout`; names by `header.matches`, or numbers from 1 where there is no header. Cells that
    are empty, NaN or NULL are NaN. Columns of `text` may hold anything, and then come as text. Where the
    first of `text`, the clock, stands in the table several times, each column is given the one nearest
    before it.

    Raises InputError, naming row and column, on another cell that is not a finite number, and on a file
    that is
    not a table. Raises OSError when the file cannot be read.
    """
    check_lines(path)
    layout = find_layout(path)
    positions: dict[str, int] = {}
    clocks: dict[str, int] = {}
    for name in wanted:
        found = _positions(layout, name)
        if len(found) > 1 and not (name in text and is_time_name(name)):
            raise InputError(f"{path}: row 1 has column {name!r} twice; rename one of them")
        if found:
            positions[name] = found[0]
        if len(found) > 1:
            clocks = {other: _nearest(found, _positions(layout, other)) for other in wanted if other != name}
    missing = tuple(name for name in wanted if name not in positions)
    if missing:
        return Table({}, missing, layout.names, "column", lambda index: f"row {index + 2}")
    try:
        columns, written = _read(
            path, layout, positions | {f"\0{name}": at for name, at in clocks.items()}, most_rows, text
        )
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text; save it as CSV in UTF-8") from None
    said = layout.said
    if len(next(iter(columns.values()), ())) < most_rows and ends_torn(path, layout):
        columns = {name: column[:-1] for name, column in columns.items()}
        said = (*said, "the last row, cut off in its midst, left out")
    place = _Places(path, layout)
    own = {name: columns.pop(f"\0{name}") for name in clocks}
    for name in text:
        if name in columns and layout.step is not None and _is_blank(columns[name]):
            columns[name] = np.arange(len(columns[name])) * layout.step
    units = written | {name: layout.units[at] for name, at in positions.items() if layout.units[at]}
    return Table(
        columns,
        (),
        layout.names,
        "column",
        place,
        units,
        own,
        {name: layout.units[at] for name, at in clocks.items() if layout.units[at]},
        said,
    )


def _positions(layout: Layout, name: str) -> list[int]:
    found = matches(layout.names, name)
    return [int(name) - 1] if not found and name.isdecimal() and 0 < int(name) <= layout.columns else found


def _nearest(clocks: Sequence[int], found: Sequence[int]) -> int:
    """The last of the clocks that stands before the column, or the first."""
    at = found[0] if found else 0
    return max((clock for clock in clocks if clock < at), default=clocks[0])


def _is_blank(column: Column) -> bool:
    if column.dtype.kind == "f":
        return bool(np.isnan(column).all())
    return all(cell.lower() in MISSING for cell in column[:1000])


def check_lines(path: Path) -> None:
    """Refuse a file with a line too long for a table, or a quote that goes on to the next, before any line is
    held in memory."""
    quoted = False
    with path.open("rb") as stream:
        for chunk in iter(lambda: stream.read(LONGEST_LINE), b""):
            if quoted or b'"' in chunk:
                for i, part in enumerate(re.split(rb"[\r\n]", chunk)):
                    if i > 0 and quoted:
                        raise InputError(f"{path}: has a quote that does not end in its row; remove it")
                    quoted ^= part.count(b'"') % 2 == 1
            if len(chunk) == LONGEST_LINE and b"\n" not in chunk and b"\r" not in chunk:
                raise InputError(
                    f"{path}: has a line longer than {LONGEST_LINE} characters; give a CSV table"
                )


def rows_of_csv(path: Path, separator: str = ",") -> Iterator[list[str]]:
    """Cells of every row of a file in UTF-8; raises InputError on what is no row of a table."""
    check_lines(path)
    try:
        with path.open(encoding="utf-8-sig", newline="") as stream:
            yield from csv.reader(stream, delimiter=separator, skipinitialspace=not separator.isspace())
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text; write it again") from None
    except csv.Error as error:
        raise InputError(f"{path}: is not a row of a table ({error}); correct it") from None


def _read(
    path: Path, layout: Layout, positions: Mapping[str, int], most_rows: int, text: Collection[str]
) -> tuple[dict[str, Column], dict[str, str]]:
    """The columns, and the units that stand behind the numbers in their cells."""
    if not positions:
        return {}, {}
    if layout.decimal == "." and not _has_stamps(path, layout, positions):
        numbers = _load_numbers(path, layout, list(positions.values()), most_rows)
        if numbers is not None and not np.isinf(numbers).any():
            return {name: numbers[:, i].copy() for i, name in enumerate(positions)}, {}
    return _read_cells(path, layout, positions, most_rows, text)


def _has_stamps(path: Path, layout: Layout, positions: Mapping[str, int]) -> bool:
    """Whether the first row holds text, or a whole number that a float would round."""
    for _, cells in _rows(path, layout):
        shown = [cells[at] if at < len(cells) else "" for at in positions.values()]
        return any(not NUMBER.fullmatch(cell) or len(cell.strip("+- ")) > LONGEST_EXACT for cell in shown)
    return False


def _load_numbers(path: Path, layout: Layout, positions: list[int], most_rows: int) -> FloatArray | None:
    """Cells at `positions`, shape (rows, columns), or None where a cell is not a number."""
    with path.open(encoding=layout.encoding) as stream, warnings.catch_warnings():
        warnings.filterwarnings("ignore", "loadtxt: input contained no data", UserWarning)
        warnings.filterwarnings("ignore", "Input line .* contained no data", UserWarning)
        for _ in range(layout.first_row):
            next(stream, "")
        try:
            numbers = np.loadtxt(
                stream,
                dtype=np.float64,
                delimiter=None if layout.separator == " " else layout.separator,
                comments=None,
                quotechar='"',
                usecols=positions,
                ndmin=2,
                max_rows=most_rows,
            )
        except UnicodeDecodeError:
            raise
        except (ValueError, OverflowError):
            return None
    return numbers.reshape(-1, len(positions))


def _rows(path: Path, layout: Layout) -> Iterator[tuple[int, list[str]]]:
    """Number, from 1, and cells of each row that is not blank nor a comment; raises InputError on what is no
    row of a table."""
    with path.open(encoding=layout.encoding) as stream:
        for number, line in itertools.islice(enumerate(stream, start=1), layout.first_row, None):
            if line == "\n" or line.startswith(COMMENTS):
                continue
            try:
                yield number, cells_of(line, layout.separator)
            except csv.Error as error:
                raise InputError(
                    f"{path}: row {number}: is not a row of a table ({error}); correct it"
                ) from None


class _Places:
    """Where in the file the row of an index stands, counted when asked for the first time."""

    def __init__(self, path: Path, layout: Layout) -> None:
        self.path, self.layout = path, layout

    def __call__(self, index: int) -> str:
        number, _ = next(itertools.islice(_rows(self.path, self.layout), index, None))
        return f"row {number}"


def _read_cells(
    path: Path, layout: Layout, positions: Mapping[str, int], most_rows: int, text: Collection[str]
) -> tuple[dict[str, Column], dict[str, str]]:
    """The same cell by cell, a stretch of rows at a time."""
    units: dict[str, str] = {}
    rows = itertools.islice(_rows(path, layout), most_rows)
    parts: dict[str, list[Column]] = {name: [] for name in positions}
    is_text = {name: name.removeprefix("\0") in text or name.startswith("\0") for name in positions}
    while stretch := list(itertools.islice(rows, ROWS_AT_ONCE)):
        stretch = _without_end(stretch)
        for name, at in positions.items():
            cells = [cells[at] if at < len(cells) else "" for _, cells in stretch]
            if is_text[name]:
                parts[name].append(np.array(cells, dtype=np.str_))
            else:
                parts[name].append(_numbers(path, layout, name.removeprefix("\0"), stretch, cells, units))
    found = {
        name: stamps_of(np.concatenate(part), layout.decimal)
        if is_text[name] and part
        else np.concatenate([np.zeros(0), *part])
        for name, part in parts.items()
    }
    return found, units


def _without_end(stretch: list[tuple[int, list[str]]]) -> list[tuple[int, list[str]]]:
    """Less what some programs write after the last row, such as EOF or `Total samples: 1800`: one cell of
    text."""
    while stretch:
        filled = list(filter(None, stretch[-1][1]))
        if len(filled) != 1 or is_value(filled[0]) or not re.match("[A-Za-z]", filled[0]):
            break
        stretch = stretch[:-1]
    return stretch


def stamps_of(cells: Column, decimal: str = ".") -> Column:
    """Stamps as whole numbers or floats where all are, else as text."""
    if len(cells) == 0:
        return np.zeros(0)
    if any(GROUPED.fullmatch(cell) for cell in cells.tolist()):
        cells = np.array(without_groups(cells.tolist()), dtype=np.str_)
    given = np.char.replace(cells, ",", ".") if decimal == "," else cells
    if NUMBER.fullmatch(str(given[0])):
        plain = [cell if NUMBER.fullmatch(cell) else "nan" for cell in given.tolist()]
        bad = [c for c in given.tolist() if c.lower() not in MISSING and not NUMBER.fullmatch(c)]
        if not bad:
            if all(re.fullmatch("[+-]?[0-9]{1,18}|[+-]?[0-8][0-9]{18}", cell) for cell in plain):
                return np.array(plain).astype(np.int64)
            return np.array([number_of(cell) for cell in plain])
    return cells


def _numbers(
    path: Path,
    layout: Layout,
    name: str,
    stretch: Sequence[tuple[int, list[str]]],
    cells: Sequence[str],
    units: dict[str, str],
) -> FloatArray:
    """Numbers of cells; the unit that some state goes to `units`."""
    values = np.empty(len(cells))
    for i, cell in enumerate(cells):
        if NUMBER.fullmatch(cell) or (layout.decimal == "," and NUMBER.fullmatch(cell.replace(",", ".", 1))):
            values[i] = number_of(cell.replace(",", ".", 1) if layout.decimal == "," else cell)
            if math.isfinite(values[i]):
                continue
        elif cell.lower() in MISSING:
            values[i] = math.nan
            continue
        elif GROUPED.fullmatch(cell):
            return _numbers(path, layout, name, stretch, without_groups(cells), units)
        elif (written := quantity_of(cell)) is not None and math.isfinite(written.value):
            values[i] = written.value
            unit = written.unit if written.unit is None else units.setdefault(name, written.unit)
            if unit == written.unit:
                continue
            raise InputError(
                f"{path}: row {stretch[i][0]}, column {name!r}: {cell[:40]!r} is in another unit than the "
                f"rows before, {unit!r}; write one unit"
            )
        raise InputError(f"{path}: row {stretch[i][0]}, column {name!r}: {_fault_of_cell(cell)}")
    return values


def _fault_of_cell(cell: str) -> str:
    shown = repr(cell[:40])
    if NUMBER.fullmatch(cell):
        return f"{shown} is too large; correct it or remove the row"
    if NUMBER.fullmatch(cell.replace(",", ".", 1)):
        return f"{shown} is not a number; write a decimal point"
    return f"{shown} is not a finite number; correct it or remove the row"
