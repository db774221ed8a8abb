"""Reading columns of numbers from Parquet files, with pyarrow (the extra `parquet`)."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.header import matches, unit_of
from bayes_hw.formats.table import Column, Table, numbers, refuse_infinite, stated_unit

MOST_BYTES = 512 * 2**20
"""Largest size of one row group, inflated, in bytes, as the file states it.

Not asked of each column: pyarrow ends the process where the metadata of a column is damaged.
"""

MOST_COLUMNS = 10_000
BATCH_ROWS = 65_536


def pyarrow_parquet(path: Path) -> ModuleType:
    """pyarrow's module for Parquet; raises InputError that names the extra where it is not installed."""
    try:
        from pyarrow import parquet
    except ImportError:
        raise InputError(
            f"{path}: Parquet files need pyarrow; pip install 'bayes-hw[parquet]', or give CSV, .mat or .h5"
        ) from None
    return parquet


def read_parquet(path: Path, wanted: Sequence[str], *, most_rows: int, text: Collection[str] = ()) -> Table:
    """Read the columns named in `wanted`, at most `most_rows` rows; empty cells are NaN, and those of
    `text` may
    hold text or dates.

    Raises InputError on a file that is no sound Parquet file, and on a column that does not hold finite real
    numbers, or a row group larger than `MOST_BYTES`. Raises OSError when the file cannot be read.
    """
    parquet = pyarrow_parquet(path)
    with path.open("rb") as stream:
        try:
            with parquet.ParquetFile(stream) as file:
                names = tuple(file.schema_arrow.names)
                if len(names) > MOST_COLUMNS:
                    raise InputError(
                        f"{path}: has more than {MOST_COLUMNS} columns; save those of the record"
                    )
                for name in wanted:
                    if names.count(name) > 1:
                        raise InputError(f"{path}: has column {name!r} twice; rename one of them")
                found = {name: at[0] for name in wanted if (at := matches(names, name))}
                present = {name: names[at] for name, at in found.items()}
                _check(path, file, present, text)
                values = _columns(path, file, present, most_rows, text)
                units = _units(file, present)
        except InputError:
            raise
        except Exception:
            # pyarrow raises its own errors, OSError, ValueError and more on damaged files.
            raise InputError(f"{path}: is not a sound Parquet file; write it again") from None
    return Table(
        values=values,
        missing=tuple(name for name in wanted if name not in values),
        names=names,
        kind="column",
        place=lambda index: f"row {index + 1}",
        units=units,
    )


def _units(file: object, names: Mapping[str, str]) -> dict[str, str]:
    """The units in the metadata `units` or `unit` of the columns, or in their names."""
    schema = file.schema_arrow  # type: ignore[attr-defined]
    found = {name: schema.field(column).metadata or {} for name, column in names.items()}
    stated = {
        name: stated_unit(held.get(b"units", held.get(b"unit"))) or unit_of(names[name])
        for name, held in found.items()
    }
    dates = {name for name, column in names.items() if str(schema.field(column).type).startswith("timestamp")}
    return {name: unit for name, unit in stated.items() if unit is not None} | dict.fromkeys(dates, "ns")


def _check(path: Path, file: object, names: Mapping[str, str], text: Collection[str]) -> None:
    from pyarrow import types

    metadata, schema = file.metadata, file.schema_arrow  # type: ignore[attr-defined]
    for name, column in names.items():
        kind = schema.field(column).type
        is_stamp = types.is_timestamp(kind) or types.is_string(kind) or types.is_large_string(kind)
        if not (types.is_integer(kind) or types.is_floating(kind) or (name in text and is_stamp)):
            raise InputError(f"{path}: column {name!r} is of type {str(kind)[:40]}; give a column of numbers")
    size = max((metadata.row_group(i).total_byte_size for i in range(metadata.num_row_groups)), default=0)
    if size > MOST_BYTES:
        raise InputError(
            f"{path}: a row group takes {size / 2**20:.0f} MB, more than the "
            f"{MOST_BYTES // 2**20} MB that are read; write smaller row groups"
        )


def _columns(
    path: Path, file: object, names: Mapping[str, str], most_rows: int, text: Collection[str]
) -> dict[str, Column]:
    parts: dict[str, list[Column]] = {name: [] for name in names}
    rows = 0
    columns = list(dict.fromkeys(names.values()))
    batches = file.iter_batches(BATCH_ROWS, columns=columns, use_threads=False)  # type: ignore[attr-defined]
    for batch in batches if names else ():
        for name, column in names.items():
            values = _values(batch.column(column), is_stamp=name in text)
            refuse_infinite(path, name, "column", values, partial(_row, rows))
            parts[name].append(values)
        rows += batch.num_rows
        if rows >= most_rows:
            break
    return {name: np.concatenate(part or [np.zeros(0)])[:most_rows] for name, part in parts.items()}


def _row(before: int, index: int) -> str:
    return f"row {before + index + 1}"


def _values(column: object, *, is_stamp: bool) -> Column:
    """Numbers, NaN where empty; dates in ns, and text as it is."""
    from pyarrow import types

    kind = column.type  # type: ignore[attr-defined]
    values = column.to_numpy(zero_copy_only=False)  # type: ignore[attr-defined]
    if types.is_timestamp(kind):
        return values.astype("datetime64[ns]").astype(np.int64)
    if types.is_string(kind) or types.is_large_string(kind):
        return np.array(["" if cell is None else cell for cell in values], dtype=np.str_)
    return numbers(values) if is_stamp else values.astype(np.float64)
