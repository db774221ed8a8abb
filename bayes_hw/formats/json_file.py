"""Reading columns from JSON: answers of InfluxDB queries, lists of rows, columns by name, one object a
line."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.header import is_time_name, matches, unit_of
from bayes_hw.formats.table import Column, Table, refuse_infinite

MOST_BYTES = 192 * 2**20
"""Largest file: what JSON decodes to takes several times its size."""

MODEL_KEYS = ('"linear"', '"saturation"', '"sample_rate_hz"')
HEAD_BYTES = 2**16


def is_model(path: Path) -> bool:
    """Whether a .json file is a model rather than a record; one that cannot be read is taken for one."""
    try:
        with path.open("rb") as stream:
            head = stream.read(HEAD_BYTES).decode("utf-8", "replace")
    except OSError:
        return True
    return any(key in head for key in MODEL_KEYS)


def read_json(path: Path, wanted: Sequence[str], *, most_rows: int, text: Collection[str] = ()) -> Table:
    """Read the columns that `wanted` names; null is NaN, those of `text` may hold text.

    Of several series, as InfluxDB answers, the one with most of the columns is the record; a column that
    another
    has comes with that one's clock. Raises InputError on what is no table, OSError on an unreadable file.
    """
    if path.stat().st_size > MOST_BYTES:
        raise InputError(
            f"{path}: is larger than the {MOST_BYTES // 2**20} MB of JSON that are read; give CSV or HDF5"
        )
    try:
        content = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path}: is not UTF-8 text; write it again") from None
    series = [found for found in _series(path, _decoded(path, content)) if found]
    if not series:
        raise InputError(
            f"{path}: holds no table: no rows with named columns, no series; give one of those or CSV"
        )
    place = lambda index: f"row {index + 1}"  # noqa: E731
    names = tuple(dict.fromkeys(name for each in series for name in each))
    best = max(series, key=lambda each: sum(bool(matches(list(each), name)) for name in wanted))
    values: dict[str, Column] = {}
    clocks: dict[str, Column] = {}
    units: dict[str, str] = {}
    for name in wanted:
        for each in [best, *(other for other in series if other is not best)]:
            found = matches(list(each), name)
            if not found:
                continue
            key = list(each)[found[0]]
            values[name] = _column(path, name, each[key][:most_rows], is_text=name in text)
            refuse_infinite(path, name, "column", values[name], place)
            if (unit := unit_of(key)) is not None:
                units[name] = unit
            clock = next((other for other in each if is_time_name(other)), None)
            if each is not best and clock is not None and name not in text:
                clocks[name] = _column(path, clock, each[clock][:most_rows], is_text=True)
            break
    missing = tuple(name for name in wanted if name not in values)
    return Table(values, missing, names, "column", place, units, clocks)


def _decoded(path: Path, content: str) -> Any:
    try:
        return json.loads(content)
    except RecursionError:
        raise InputError(f"{path}: is JSON nested too deeply; give a table") from None
    except ValueError as error:
        lines = [line for line in content.splitlines() if line.strip()]
        if len(lines) > 1 and lines[0].lstrip().startswith("{"):
            try:
                return [json.loads(line) for line in lines]
            except (ValueError, RecursionError):
                pass
        raise InputError(f"{path}: is not JSON ({error})") from None


def _series(path: Path, data: Any) -> list[dict[str, list[Any]]]:
    """Every table in the data, as columns by name."""
    if isinstance(data, list):
        if data and all(
            isinstance(row, Mapping) and "series" not in row and "results" not in row for row in data
        ):
            flat = [_flat(row) for row in data]
            names = dict.fromkeys(name for row in flat for name in row)
            return [{name: [row.get(name) for row in flat] for name in names}]
        return [each for item in data[:1000] if isinstance(item, Mapping) for each in _series(path, item)]
    if not isinstance(data, Mapping):
        return []
    for key in ("results", "series", "tables"):
        if isinstance(data.get(key), list):
            return [each for item in data[key] if isinstance(item, Mapping) for each in _series(path, item)]
    rows = data.get("values", data.get("data"))
    columns = data.get("columns")
    if isinstance(columns, list) and isinstance(rows, list):
        return [_named(path, data, [str(name) for name in columns], rows)]
    for key in ("data", "records", "rows", "frames", "result"):
        if isinstance(data.get(key), (list, Mapping)):
            found = _series(path, data[key])
            if found:
                return found
    lists = {str(name): values for name, values in data.items() if isinstance(values, list)}
    return [lists] if lists else []


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row whose objects are taken apart: {"cmd": {"vel": 1}} is {"cmd.vel": 1}."""
    found: dict[str, Any] = {}
    for name, value in row.items():
        if isinstance(value, Mapping):
            found |= {f"{name}.{inner}": item for inner, item in value.items()}
        else:
            found[str(name)] = value
    return found


def _named(
    path: Path, series: Mapping[str, Any], names: Sequence[str], rows: Sequence[Any]
) -> dict[str, list[Any]]:
    """The columns of one series; a lone `value` or mean takes the name of the series or its tag as well."""
    for number, row in enumerate(rows, start=1):
        if not isinstance(row, list) or len(row) != len(names):
            raise InputError(
                f"{path}: row {number}: does not have the {len(names)} values of its columns; correct it"
            )
    found = {name: [row[i] for row in rows] for i, name in enumerate(names)}
    values = [name for name in names if not is_time_name(name)]
    tags = series.get("tags")
    labels = [str(tag) for tag in tags.values()] if isinstance(tags, Mapping) else []
    if len(values) == 1:
        for label in [*labels, series.get("name")]:
            if isinstance(label, str) and label not in found:
                found[label] = found[values[0]]
    return found


def _column(path: Path, name: str, cells: Sequence[Any], *, is_text: bool) -> Column:
    """Numbers, null as NaN; whole numbers stay whole in a clock, and text stays text."""
    if is_text and any(isinstance(cell, str) for cell in cells):
        return np.array(["" if cell is None else str(cell) for cell in cells], dtype=np.str_)
    whole = bool(cells) and all(type(cell) is int and abs(cell) < 2**63 for cell in cells)
    if is_text and whole:
        return np.array(cells, dtype=np.int64)
    values = np.empty(len(cells))
    for i, cell in enumerate(cells):
        try:
            if isinstance(cell, bool) or not (cell is None or isinstance(cell, (int, float, str))):
                raise ValueError
            values[i] = np.nan if cell is None or cell in ("", "NaN", "null") else float(cell)
        except (ValueError, OverflowError):
            raise InputError(
                f"{path}: row {i + 1}, column {name!r}: {str(cell)[:40]!r} is not a finite number; correct it"
            ) from None
    return values
