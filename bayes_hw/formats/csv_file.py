"""Reading columns of numbers from delimited text."""

from __future__ import annotations

import csv
import itertools
import math
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.table import Table

LONGEST_LINE = 2**20
DELIMITERS = ",;\t"

_NUMBER = re.compile(r"\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?\s*", re.ASCII)


def read_csv(path: Path, wanted: Sequence[str], *, most_rows: int) -> Table:
    """Read the columns named in `wanted`, at most `most_rows` rows, from UTF-8 text with a header.

    The delimiter is that of comma, semicolon and tab which the header has most of. Blank lines are
    skipped but counted: the header is row 1. Other columns may hold anything.

    Raises InputError, naming the row and column, on a cell that is not a finite number, and on a
    file that is not such a table. Raises OSError when the file cannot be read.
    """
    _check_lines(path)
    try:
        with path.open(encoding="utf-8-sig") as stream:
            header, delimiter = _read_header(path, stream)
            for name in wanted:
                if header.count(name) > 1:
                    raise InputError(f"{path}: row 1 has column {name!r} twice; rename one of them")
            values: dict[str, FloatArray] = {}
            missing = tuple(name for name in wanted if name not in header)
            if not missing:
                positions = {name: header.index(name) for name in wanted}
                numbers = _load_numbers(stream, delimiter, list(positions.values()), most_rows)
                if numbers is None or not np.isfinite(numbers).all():
                    raise _cell_fault(path, delimiter, positions)
                values = {name: numbers[:, i].copy() for i, name in enumerate(positions)}
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text; save it as CSV in UTF-8") from None
    return Table(
        values=values,
        missing=missing,
        names=tuple(header),
        kind="column",
        place=lambda index: f"row {_file_row(path, index)}",
    )


def _check_lines(path: Path) -> None:
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


def _read_header(path: Path, stream: TextIO) -> tuple[list[str], str]:
    line = stream.readline()
    delimiter = max(DELIMITERS, key=line.count)
    try:
        cells = next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error as error:
        raise InputError(
            f"{path}: row 1 is not a header ({error}); put the column names there, such as t,u,y"
        ) from None
    header = [cell.strip() for cell in cells]
    if not any(header):
        raise InputError(f"{path}: row 1 is blank; put the column names there, such as t,u,y")
    if all(_NUMBER.fullmatch(name) for name in header):
        raise InputError(
            f"{path}: row 1 holds numbers; put a header of column names before it, such as t,u,y"
        )
    return header, delimiter


def _load_numbers(stream: TextIO, delimiter: str, positions: list[int], most_rows: int) -> FloatArray | None:
    """Cells at `positions`, shape (rows, columns), or None where a cell is not a number."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "loadtxt: input contained no data", UserWarning)
        warnings.filterwarnings("ignore", "Input line .* contained no data", UserWarning)
        try:
            numbers = np.loadtxt(
                stream,
                dtype=np.float64,
                delimiter=delimiter,
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


def _rows(path: Path, delimiter: str) -> Iterator[tuple[int, list[str]]]:
    """Row number and cells of each row that is not blank, the header included."""
    with path.open(encoding="utf-8-sig") as stream:
        reader = csv.reader(stream, delimiter=delimiter)
        for cells in reader:
            if cells:
                yield reader.line_num, cells


def _file_row(path: Path, index: int) -> int:
    with path.open(encoding="utf-8-sig") as stream:
        rows = (number for number, line in enumerate(stream, start=1) if line != "\n")
        return next(itertools.islice(rows, index + 1, None))


def _cell_fault(path: Path, delimiter: str, positions: Mapping[str, int]) -> InputError:
    """The error that names the first cell of the wanted columns that is not a finite number."""
    row = 1
    try:
        for row, cells in itertools.islice(_rows(path, delimiter), 1, None):
            for name, position in positions.items():
                cell = cells[position] if position < len(cells) else ""
                fault = _fault_of_cell(cell)
                if fault:
                    return InputError(f"{path}: row {row}, column {name!r}: {fault}")
    except csv.Error as error:
        return InputError(f"{path}: row {row + 1}: is not a row of a table ({error}); correct it")
    return InputError(f"{path}: is not a table of numbers; check its quotes and separators")


def _fault_of_cell(cell: str) -> str:
    if not cell.strip():
        return "empty cell; fill it in or remove the row"
    if not _NUMBER.fullmatch(cell):
        shown = repr(cell.strip()[:40])
        if _NUMBER.fullmatch(cell.replace(",", ".", 1)):
            return f"{shown} is not a number; write a decimal point"
        return f"{shown} is not a finite number; correct it or remove the row"
    if not math.isfinite(float(cell)):
        return f"{cell.strip()[:40]!r} is too large; correct it or remove the row"
    return ""
