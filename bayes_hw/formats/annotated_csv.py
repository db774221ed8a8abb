"""Reading InfluxDB's annotated CSV: tables one below the other, one row a value, fields under `_field`.

Source: InfluxData, "Annotated CSV", annotations #datatype, #group and #default.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from pathlib import Path

from bayes_hw.errors import InputError
from bayes_hw.formats.csv_file import rows_of_csv
from bayes_hw.formats.long_table import table_of_fields
from bayes_hw.formats.table import Table

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
