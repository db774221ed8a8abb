"""How a text file lays out its table: encoding, separator, decimal sign, where header, units and rows
begin."""

from __future__ import annotations

import codecs
import csv
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bayes_hw.errors import InputError
from bayes_hw.formats.grouped_digits import GROUPED, decimal_sign
from bayes_hw.formats.header import bare_unit, looks_like_unit, paired_header, unit_of

HEAD_BYTES = 2**20
HEAD_LINES = 400
TAIL_LINES = 60
SEPARATORS = ("\t", ";", "|", ",", " ")
"""In the order of preference where several would do; a blank stands for any white space."""

WORDS = {"\t": "tabs", ";": "semicolons", "|": "bars", ",": "commas", " ": "blanks"}
MISSING = frozenset(
    {"", "nan", "-nan", "null", "na", "n/a", "#n/a", "none", "nil", "nat", "-nan(ind)", "1.#qnan"}
    | {"-", "--", "---", "#na", "#num!", "#value!", "#div/0!"}
)
TYPES = frozenset(
    {
        "double",
        "float",
        "float32",
        "float64",
        "single",
        "int",
        "integer",
        "int32",
        "int64",
        "uint32",
        "uint64",
    }
    | {"long", "string", "str", "text", "char", "bool", "boolean", "datetime", "timestamp", "object"}
)
"""Words of a row that says what the columns hold, as some programs write it beneath the names."""

MINUS = "\u2212"
COMMENTS = ("#", "%", "//", "!")

RULE = re.compile(r"\s*[|+]-[-+|:= ]*\s*")
"""A line drawn below the names of a table."""
NUMBER = re.compile(r"\s*[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eEdD][+-]?[0-9]+)?\s*", re.ASCII)
COMMA_NUMBER = re.compile(r"\s*[+-]?[0-9]*,[0-9]+([eE][+-]?[0-9]+)?\s*", re.ASCII)
STAMP = re.compile(
    r"\s*([0-9]{1,4}[-/.:][0-9A-Za-z]{1,3}[-/.:][0-9]{1,4}.*|[0-9]{4}-?[0-9]{2,4}T.*|[0-9]+:[0-9]{2}.*"
    r"|[0-9.]+ ?(s|sec|ms|min|hr))\s*",
    re.ASCII,
)
_DATE_AND_TIME = re.compile(
    r"([0-9]{4}[-/][0-9]{2}[-/][0-9]{2}|[0-9]{1,2}-[A-Za-z]{3}-[0-9]{4}|[0-9]{1,2}[./][0-9]{1,2}[./][0-9]{4})"
    r"[ \t]+(?=[0-9]{1,2}:)"
)
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)


@dataclass(frozen=True)
class Layout:
    """Of a table in a text file: `first_row` is the number, from 0, of the first line with values;
    `units` are
    those of header and row of units, by column, "" where there is none."""

    encoding: str
    separator: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    first_row: int
    columns: int
    step: float | None
    said: tuple[str, ...]


def cells_of(line: str, separator: str) -> list[str]:
    """The cells of a line, without the blanks around them; raises csv.Error on one that cannot be a row."""
    line = line.replace(MINUS, "-")
    if separator == " ":
        return _DATE_AND_TIME.sub(r"\1T", line).split()
    if separator == "|" and (framed := line.strip()).startswith("|") and framed.endswith("|"):
        line = framed[1:-1]
    return [
        cell.strip()
        for cell in next(
            csv.reader([line], delimiter=separator, skipinitialspace=not separator.isspace()), []
        )
    ]


def number_of(cell: str) -> float:
    """The number that a cell matching `NUMBER` is; Fortran writes D for the exponent of a double."""
    return float(cell.replace("D", "e").replace("d", "e"))


def is_value(cell: str) -> bool:
    """Whether a cell can be one of a table's rows: a number, a time stamp, or nothing."""
    return bool(
        cell.lower() in MISSING
        or NUMBER.fullmatch(cell)
        or COMMA_NUMBER.fullmatch(cell)
        or GROUPED.fullmatch(cell)
        or STAMP.fullmatch(cell)
    )


def find_layout(path: Path) -> Layout:
    """The layout of the table in `path`; raises InputError where there is none."""
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
        whole = not stream.read(1)
    encoding, text = _decoded(path, head, whole)
    lines = re.split(r"\r\n|\r|\n", text)
    lines = lines[: HEAD_LINES if whole else min(HEAD_LINES, max(len(lines) - 1, 1))]
    try:
        return _layout(path, encoding, lines)
    except csv.Error as error:
        raise InputError(
            f"{path}: row 1 is not a header ({error}); put the column names there, such as t,u,y"
        ) from None


def _decoded(path: Path, head: bytes, whole: bool) -> tuple[str, str]:
    for mark, encoding in _MARKS:
        if head.startswith(mark):
            try:
                return encoding, head.decode(encoding, "strict" if whole else "ignore")
            except UnicodeDecodeError:
                raise InputError(f"{path}: ends within a letter of {encoding}; save it as UTF-8") from None
    if b"\0" in head:
        raise InputError(f"{path}: is not text; save it as CSV in UTF-8")
    try:
        return "utf-8", codecs.getincrementaldecoder("utf-8")().decode(head, final=whole)
    except UnicodeDecodeError:
        pass
    try:
        return "cp1252", head.decode("cp1252")
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text; save it as CSV in UTF-8") from None


def _layout(path: Path, encoding: str, lines: Sequence[str]) -> Layout:
    filled = [i for i, line in enumerate(lines) if line.strip() and not RULE.fullmatch(line)]
    if not filled:
        raise InputError(f"{path}: row 1 is blank; put the column names there, such as t,u,y")
    tail = [lines[i] for i in filled[-TAIL_LINES:] if not lines[i].lstrip().startswith(COMMENTS)]
    separator, columns = _separator(tail or [lines[filled[0]]])
    rows = {i: _cells(lines[i], separator) for i in filled}
    sample = [rows[i] for i in filled[-TAIL_LINES:] if _columns(rows[i]) == columns]
    is_numeric = [
        2 * sum(is_value(row[j]) for row in sample if j < len(row)) > len(sample) for j in range(columns)
    ]
    is_data = {i: _columns(row) == columns and _is_data(row, is_numeric) for i, row in rows.items()}
    first = _first_of_many(filled, is_data)
    before = [i for i in filled if first is None or i < first]
    plain = [i for i in before if _is_header(rows[i], columns) and not lines[i].lstrip().startswith(COMMENTS)]
    if first is None:
        plain = plain[:1]
    header: list[list[str]] = [rows[i] for i in plain]
    last = plain[-1] if plain else -1
    if not plain:
        stripped = {i: _cells(lines[i].lstrip(" #%!/;\"'"), separator) for i in before}
        commented = [i for i in before if _is_header(stripped[i], columns)]
        header = [stripped[i] for i in commented if len(stripped[i]) == columns or columns < 2]
    if not header and separator == "," and any(2 * len(rows[i]) == columns for i in before):
        raise InputError(
            f"{path}: rows have two cells for each name of the header: decimal commas between commas; write "
            "semicolons between the columns, or decimal points"
        )
    names, row_units = _names_and_units(header)
    if first is not None and (paired := paired_header([rows[i] for i in before], columns)) is not None:
        names, row_units = paired
    if first is None:
        first = last + 1 if plain else filled[-1] + 1
    elif plain:
        after = [i for i in filled if i > last and not lines[i].lstrip().startswith(COMMENTS)]
        first = next((i for i in after if not _is_types(rows[i])), first)
    if names:
        columns = max(columns, len(names))
    units = tuple(
        (row_units[j] if j < len(row_units) else "") or (unit_of(names[j]) or "" if j < len(names) else "")
        for j in range(columns)
    )
    cells = [cell for row in sample for cell in row]
    comma = separator != "," or any('"' in line for line in tail)
    is_comma = any(COMMA_NUMBER.fullmatch(cell) or decimal_sign(cell) == "," for cell in cells)
    decimal = "," if comma and is_comma else "."
    said = _said(encoding, decimal, plain[-1] if plain else 0, lines, bool(names))
    return Layout(
        encoding,
        separator,
        decimal,
        tuple(names) or tuple(str(j + 1) for j in range(columns)),
        units,
        first,
        columns,
        _stated_step(lines[:first]),
        said,
    )


def _first_of_many(filled: Sequence[int], is_data: Mapping[int, bool]) -> int | None:
    """The first line of values that others follow: four of five, or as many as there are."""
    for n, i in enumerate(filled):
        following = [is_data[j] for j in filled[n : n + 5]]
        if is_data[i] and 5 * sum(following) >= 4 * len(following):
            return i
    return next((i for i in filled if is_data[i]), None)


def _cells(line: str, separator: str) -> list[str]:
    try:
        return cells_of(line, separator)
    except csv.Error:
        return [line]


def _columns(row: Sequence[str]) -> int:
    """Cells of a row, less the empty ones that a separator at its end makes."""
    return len(row) - (len(row) > 2 and not row[-1])


def _separator(lines: Sequence[str]) -> tuple[str, int]:
    """The separator that makes most cells of these lines values, and how many columns it makes."""
    best = ("", 0, -1.0)
    for separator in SEPARATORS:
        rows = [_cells(line, separator) for line in lines]
        (columns, often) = Counter(map(_columns, rows)).most_common(1)[0]
        if columns < 2:
            continue
        values = sum(is_value(cell) for row in rows for cell in row) / sum(map(len, rows))
        score = values * often / len(rows)
        if score > best[2] + 1e-9:
            best = (separator, columns, score)
    if best[2] < 0.25:
        separator = max(",;\t|", key=lines[0].count)
        return separator, _columns(_cells(lines[0], separator))
    return best[0], best[1]


def _is_data(row: Sequence[str], is_numeric: Sequence[bool]) -> bool:
    """Whether more than half of the cells in columns of values are values, and one is a number or stamp."""
    judged = [row[j] if j < len(row) else "" for j, numeric in enumerate(is_numeric) if numeric]
    good = [is_value(cell) for cell in judged]
    shown = any(cell.lower() not in MISSING and is_value(cell) for cell in judged)
    return len(row) > 1 and shown and 2 * sum(good) > len(good)


def _is_header(row: Sequence[str], columns: int) -> bool:
    """Whether a row can be one of names or units: as many cells as columns, and not one a number."""
    enough = columns <= len(row) <= columns + 1 or len(row) - 1 == columns
    return (
        enough and any(row) and not _is_types(row) and not any(NUMBER.fullmatch(c) for c in row if c != "1")
    )


def _is_types(row: Sequence[str]) -> bool:
    """Whether a row says what its columns hold, one word twice: names differ."""
    return all(cell.lower() in TYPES for cell in row if cell) and len(set(row)) < len(row)


def _names_and_units(rows: Sequence[list[str]]) -> tuple[list[str], list[str]]:
    """Of the rows that may be headers: the last, or the one before a row of units."""
    if not rows:
        return [], []
    for i in range(len(rows) - 1, 0, -1):
        units = [bare_unit(cell) for cell in rows[i]]
        held = [unit for unit in units if unit]
        if (
            held
            and all(looks_like_unit(unit) for unit in held)
            and any(unit not in ("-", "1") for unit in held)
        ):
            return rows[i - 1], [unit if unit not in ("-", "1", "none") else "" for unit in units]
    return rows[-1], []


def _stated_step(lines: Sequence[str]) -> float | None:
    """The time between samples that a LabVIEW measurement file states before its header, in s."""
    for line in lines:
        cells = line.split("\t")
        if cells[0] == "Delta_X" and len(cells) > 1 and is_value(cells[1]):
            return float(cells[1].replace(",", ".") or "nan")
    return None


def _said(
    encoding: str, decimal: str, skipped: int, lines: Sequence[str], has_header: bool
) -> tuple[str, ...]:
    said = []
    if any(line.strip() for line in lines[:skipped]):
        said.append(f"{skipped} line{'s' if skipped > 1 else ''} before the header left out")
    if decimal == ",":
        said.append("numbers read with decimal commas")
    if encoding == "cp1252":
        said.append("text read as Windows-1252, not being UTF-8")
    return tuple(said) if has_header else ()
