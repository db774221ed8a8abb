"""Which reader a file needs: by its ending, and where that is .csv, .txt or none, by its first bytes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from bayes_hw.errors import InputError
from bayes_hw.formats.split_seconds import halves_of, with_split_clocks
from bayes_hw.formats.table import Table

HDF5, PARQUET = (".h5", ".hdf5", ".hdf"), (".parquet", ".pq")
FITS = (".fits", ".fit", ".fts")
BAGS = (".mcap", ".bag", ".db3")
"""Endings of files, without regard to case."""


def read_table(path: Path, wanted: Sequence[str], clocks: Sequence[str], *, most_rows: int) -> Table:
    """The columns `wanted`, at most `most_rows` rows.

    `clocks` among them may be text, or stand in two columns as `split_seconds` has them.
    """
    split = [name for name in clocks if halves_of(name) is not None]
    halves = [half for name in split for half in halves_of(name) or ()]
    asked = [*(name for name in wanted if name not in split), *halves]
    table = _table_of(path, list(dict.fromkeys(asked)), clocks, most_rows=most_rows)
    if not split:
        return table
    table = with_split_clocks(table, split)
    return replace(table, missing=(*table.missing, *(name for name in split if name not in table.values)))


def _table_of(path: Path, wanted: Sequence[str], clocks: Sequence[str], *, most_rows: int) -> Table:
    """The same of clocks in one column.

    Readers are imported when they are needed: their libraries take longer than most refusals may.
    """
    suffix = path.suffix.lower()
    if suffix in PARQUET:
        from bayes_hw.formats.parquet_file import read_parquet

        return read_parquet(path, wanted, most_rows=most_rows, text=clocks)
    if suffix in FITS:
        from bayes_hw.formats.fits_file import read_fits

        return read_fits(path, wanted, most_rows=most_rows)
    if suffix == ".tdms":
        from bayes_hw.formats.tdms_file import read_tdms

        return read_tdms(path, wanted, most_rows=most_rows)
    if suffix in BAGS or path.is_dir():
        from bayes_hw.formats.bag_file import read_bag

        return read_bag(path, wanted, most_rows=most_rows)
    if suffix in HDF5 or suffix == ".mat":
        return _with_timetables(path, wanted, clocks, suffix, most_rows)
    if suffix in (".json", ".jsonl", ".ndjson") or _holds_json(path):
        from bayes_hw.formats.json_file import read_json

        return read_json(path, wanted, most_rows=most_rows, text=clocks)
    _refuse_packed(path)
    from bayes_hw.formats.csv_file import read_csv
    from bayes_hw.formats.long_table import is_annotated, read_annotated

    if is_annotated(path):
        return read_annotated(path, wanted, most_rows=most_rows, text=clocks)
    from bayes_hw.formats.long_table import long_columns, read_long

    at = long_columns(path)
    if at is not None:
        return read_long(path, at, wanted, most_rows=most_rows, text=clocks)
    from bayes_hw.formats.key_values import holds_key_values, read_key_values

    if holds_key_values(path):
        return read_key_values(path, wanted, most_rows=most_rows, text=clocks)
    return read_csv(path, wanted, most_rows=most_rows, text=clocks)


PACKED = {
    b"\x1f\x8b": "is compressed with gzip; unpack it first (gunzip)",
    b"BZh": "is compressed with bzip2; unpack it first (bunzip2)",
    b"\xfd7zXZ": "is compressed with xz; unpack it first (unxz)",
    b"\x28\xb5\x2f\xfd": "is compressed with zstd; unpack it first (unzstd)",
    b"PK\x03\x04": "is a ZIP archive, as .npz and .xlsx files are; save the table in it as CSV",
    b"\x93NUMPY": "is an array of NumPy; save it as CSV, or give its columns to Record.from_arrays in Python",
    b"\xd0\xcf\x11\xe0": "is a workbook of an old Excel; save its sheet as CSV",
    b"ARROW1": "is an Arrow (Feather) file; save it as Parquet or CSV",
}
"""First bytes of files that hold no text, and what to do with them."""


JSON = re.compile(rb'(?:\xef\xbb\xbf)?\s*(?:\[\s*)?\{\s*"')
"""How a file begins that holds an object, or a list of them."""


def _holds_json(path: Path) -> bool:
    with path.open("rb") as stream:
        return JSON.match(stream.read(64)) is not None


def _refuse_packed(path: Path) -> None:
    with path.open("rb") as stream:
        first = stream.read(8)
    for mark, said in PACKED.items():
        if first.startswith(mark):
            raise InputError(f"{path}: {said}")


def _with_timetables(
    path: Path, wanted: Sequence[str], clocks: Sequence[str], suffix: str, most_rows: int
) -> Table:
    from bayes_hw.formats.matlab_elements import READABLE, ObjectError

    try:
        return _hdf5_or_matlab(path, wanted, clocks, suffix, most_rows)
    except ObjectError as met:
        from bayes_hw.formats.timetable_file import can_read_timetables, read_timetable

        if met.class_name not in READABLE or not can_read_timetables():
            raise
        return read_timetable(path, met.name, wanted, clocks, most_rows=most_rows)


def _hdf5_or_matlab(
    path: Path, wanted: Sequence[str], clocks: Sequence[str], suffix: str, most_rows: int
) -> Table:
    from bayes_hw.formats.hdf5_file import is_hdf5, read_hdf5

    if suffix in HDF5 or is_hdf5(path):
        return read_hdf5(path, wanted, most_rows=most_rows, text=clocks)
    from bayes_hw.formats.iddata import read_iddata
    from bayes_hw.formats.matlab_file import read_matlab

    table = read_matlab(path, wanted, most_rows=most_rows)
    signals = [name for name in wanted if name not in clocks]
    if signals and all(name in table.missing for name in signals[:2]):
        time = clocks[0] if clocks else "t"
        return read_iddata(
            path, (time, signals[0], signals[1] if len(signals) > 1 else "y"), most_rows=most_rows
        ) or (table)
    return table
