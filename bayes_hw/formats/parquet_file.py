"""Reading columns of numbers from Parquet files, with pyarrow (the extra `parquet`)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.table import Table, stated_unit

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


def read_parquet(path: Path, wanted: Sequence[str], *, most_rows: int) -> Table:
    """Read the columns named in `wanted`, at most `most_rows` rows.

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
                present = [name for name in wanted if name in names]
                _check(path, file, present)
                values = _columns(path, file, present, most_rows)
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


def _units(file: object, names: Sequence[str]) -> dict[str, str]:
    """The units in the metadata `units` or `unit` of the columns."""
    schema = file.schema_arrow  # type: ignore[attr-defined]
    found = {name: schema.field(name).metadata or {} for name in names}
    stated = {name: stated_unit(held.get(b"units", held.get(b"unit"))) for name, held in found.items()}
    return {name: unit for name, unit in stated.items() if unit is not None}


def _check(path: Path, file: object, names: Sequence[str]) -> None:
    from pyarrow import types

    metadata, schema = file.metadata, file.schema_arrow  # type: ignore[attr-defined]
    for name in names:
        kind = schema.field(name).type
        if not (types.is_integer(kind) or types.is_floating(kind)):
            raise InputError(f"{path}: column {name!r} is of type {str(kind)[:40]}; give a column of numbers")
    size = max((metadata.row_group(i).total_byte_size for i in range(metadata.num_row_groups)), default=0)
    if size > MOST_BYTES:
        raise InputError(
            f"{path}: a row group takes {size / 2**20:.0f} MB, more than the "
            f"{MOST_BYTES // 2**20} MB that are read; write smaller row groups"
        )


def _columns(path: Path, file: object, names: Sequence[str], most_rows: int) -> dict[str, FloatArray]:
    parts: dict[str, list[FloatArray]] = {name: [] for name in names}
    rows = 0
    batches = file.iter_batches(BATCH_ROWS, columns=list(names), use_threads=False)  # type: ignore[attr-defined]
    for batch in batches if names else ():
        for name in names:
            column = batch.column(name)
            values = column.to_numpy(zero_copy_only=False).astype(np.float64)
            faults = np.flatnonzero(~np.isfinite(values))
            if len(faults):
                held = "empty" if column[int(faults[0])].as_py() is None else values[faults[0]]
                raise InputError(
                    f"{path}: row {rows + faults[0] + 1}, column {name!r}: {held} is not a finite number; "
                    "correct it or remove the row"
                )
            parts[name].append(values)
        rows += batch.num_rows
        if rows >= most_rows:
            break
    return {name: np.concatenate([np.zeros(0), *part])[:most_rows] for name, part in parts.items()}
