"""Reading records from CSV, MATLAB, HDF5 and Parquet files, refusing what cannot be one."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bayes_hw import time_stamps
from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.csv_file import read_csv
from bayes_hw.formats.hdf5_file import is_hdf5, read_hdf5
from bayes_hw.formats.iddata import read_iddata
from bayes_hw.formats.matlab_file import read_matlab
from bayes_hw.formats.parquet_file import read_parquet
from bayes_hw.formats.table import Table
from bayes_hw.resample import MOST_SAMPLES, describe, resample_columns

HDF5, PARQUET = (".h5", ".hdf5", ".hdf"), (".parquet", ".pq")
"""Endings of files, without regard to case."""

FEWEST_SAMPLES = 32
MOST_BYTES = 512 * 2**20
LOWEST_RATE_HZ, HIGHEST_RATE_HZ = 0.1, 1e6
"""Rates outside are those of stamps in ms, ns or days, not in s."""

LARGEST_VALUE = 1e12
"""A value beyond is a glitch of the log, and overflows when squared and summed."""

LEAST_CHANGE = 1e-14
"""A column that changes by no more than this times its largest value or 1 is constant."""

MOST_GAPS = 0.5
"""Largest part of a record, in time, that resampling may bridge."""

RATE_TOLERANCE = 0.01
"""Largest relative difference between a given sample rate and that of the time stamps."""


@dataclass(frozen=True)
class Columns:
    """Names of a file's columns or variables; `time` is None when the file holds no time stamps."""

    time: str | None = "t"
    input: str = "u"
    output: str = "y"


class FileContent(NamedTuple):
    """What a file holds of a record: columns (samples,), rate, digest, what was done to them, and the units
    that it states, by role ("time", "input", "output")."""

    t: FloatArray
    u: FloatArray
    y: FloatArray
    sample_rate_hz: float
    sha256: str
    treatment: tuple[str, ...]
    units: Mapping[str, str]


def read_columns(
    path: Path,
    columns: Columns,
    *,
    sample_rate_hz: float | None = None,
    resample_hz: float | None = None,
) -> FileContent:
    """Read one record from the file at `path`, whose ending says its format.

    `.mat` is MATLAB, `.h5`, `.hdf5` and `.hdf` are HDF5, `.parquet` and `.pq` Parquet, anything else
    CSV; see `read_csv`, `read_matlab`, `read_hdf5`, `read_parquet`. A MATLAB file without variables
    of the names asked for, but with an iddata structure, is read by `read_iddata`. `sample_rate_hz`
    stands for the time stamps when `columns.time` is None, and is otherwise checked against them
    (1 %). Stamps that are not uniform in the sense of `time_stamps.is_uniform` are refused,
    unless `resample_hz` gives the rate to put the record on, as `resample.resample_columns` does.

    Raises InputError, naming the file, the row or column, and the remedy, on anything that is not
    a record: fewer than 32 or more than 10,000,000 samples, a missing column, a cell that is not
    a finite number or is beyond 1e12, stamps that repeat or go back, a constant input or output.
    """
    for option, rate in (("--sample-rate", sample_rate_hz), ("--resample", resample_hz)):
        if rate is not None and not (math.isfinite(rate) and rate > 0):
            raise InputError(f"{option} {rate!r}: give a positive rate in Hz")
    if columns.time is None and sample_rate_hz is None:
        raise InputError(f"{path}: no time column is named; give --sample-rate RATE in Hz")
    roles = {"time": columns.time, "input": columns.input, "output": columns.output}
    wanted = {role: name for role, name in roles.items() if name is not None}
    if len(set(wanted.values())) < len(wanted):
        raise InputError(
            f"{path}: one column is named twice among {', '.join(map(repr, wanted.values()))}; "
            "give --time, --input and --output different names"
        )
    with _os_errors(path):
        digest = _digest(path)
        table = _table(path, columns, list(wanted.values()))
        _check_columns(path, table, wanted)
        if columns.time is None:
            assert sample_rate_hz is not None
            t = np.arange(len(table.values[columns.input])) / sample_rate_hz
        else:
            t = table.values[columns.time]
            _check_stamps(path, t, table)
        rate, treatment = _rate(path, t, table, sample_rate_hz, may_be_uneven=resample_hz is not None)
        if columns.time is None:
            treatment = (f"time counted from 0 s at the given rate of {rate:g} Hz",)
        u, y = table.values[columns.input], table.values[columns.output]
        if resample_hz is not None and not (rate == resample_hz and time_stamps.is_uniform(t)):
            _check_gaps(path, t, table)
            treatment = (*treatment, describe(t, resample_hz, table.place))
            t, u, y = _resampled(path, t, u, y, resample_hz)
            rate = resample_hz
    units = {role: table.units[name] for role, name in wanted.items() if name in table.units}
    return FileContent(t, u, y, float(rate), digest, treatment, units)


def _table(path: Path, columns: Columns, wanted: list[str]) -> Table:
    """The columns `wanted` by the reader of the file's format."""
    suffix, rows = path.suffix.lower(), MOST_SAMPLES + 1
    if suffix in PARQUET:
        return read_parquet(path, wanted, most_rows=rows)
    if suffix in HDF5 or (suffix == ".mat" and is_hdf5(path)):
        return read_hdf5(path, wanted, most_rows=rows)
    if suffix != ".mat":
        return read_csv(path, wanted, most_rows=rows)
    table = read_matlab(path, wanted, most_rows=rows)
    if columns.input in table.missing and columns.output in table.missing:
        names = (columns.time or Columns.time or "", columns.input, columns.output)
        return read_iddata(path, names, most_rows=rows) or table
    return table


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


def _digest(path: Path) -> str:
    """SHA-256 of the file; refuses what is not a file, is empty, or is too large."""
    if path.is_dir():
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


def _check_columns(path: Path, table: Table, wanted: dict[str, str]) -> None:
    for role, name in wanted.items():
        if name in table.missing:
            shown = ", ".join(repr(other[:40]) for other in table.names[:20])
            more = ", ..." if len(table.names) > 20 else ""
            without = ", or give --time none --sample-rate RATE" if role == "time" else ""
            raise InputError(
                f"{path}: no {table.kind} {name!r} for the {role}; it has {shown or 'none'}{more}: "
                f"map one with --{role} NAME{without}"
            )
    lengths = {name: len(values) for name, values in table.values.items()}
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{name!r} has {length}" for name, length in lengths.items())
        raise InputError(f"{path}: {found} samples; give {table.kind}s of one length")
    samples = next(iter(lengths.values()))
    if samples < FEWEST_SAMPLES:
        raise InputError(
            f"{path}: has {samples} samples of the {FEWEST_SAMPLES} that a record needs; give a longer one"
        )
    if samples > MOST_SAMPLES:
        raise InputError(f"{path}: has more than {MOST_SAMPLES:,} samples; cut the record into parts")
    for role, name in wanted.items():
        values = table.values[name]
        largest = int(np.abs(values).argmax())
        size = abs(float(values[largest]))
        if size > LARGEST_VALUE:
            raise InputError(
                f"{path}: {table.place(largest)}, {table.kind} {name!r}: {values[largest]:g} is "
                f"beyond {LARGEST_VALUE:g}; correct it, or give the {role} in a larger unit"
            )
        if role != "time" and np.ptp(values) <= LEAST_CHANGE * max(size, 1.0):
            raise InputError(
                f"{path}: {table.kind} {name!r} is {values[0]:g} throughout, which shows "
                f"nothing of the axis; give a record that moves, or map another with --{role} NAME"
            )


def _check_stamps(path: Path, t: FloatArray, table: Table) -> None:
    fault = time_stamps.first_not_increasing(t)
    if fault is not None:
        before, here = float(t[fault - 1]), float(t[fault])
        verb = "repeats" if before == here else "goes back from"
        stamps = f"{here!r}" if before == here else f"{before!r} to {here!r}"
        raise InputError(
            f"{path}: {table.place(fault)}: time stamp {verb} {stamps}; "
            "remove the row, or give --time none --sample-rate RATE"
        )
    median = float(np.median(np.diff(t)))
    if not 1 / HIGHEST_RATE_HZ <= median <= 1 / LOWEST_RATE_HZ:
        raise InputError(
            f"{path}: time stamps step by {median:.4g} (median); give times in s, at a rate of "
            f"{LOWEST_RATE_HZ:g} to {HIGHEST_RATE_HZ:g} Hz{_in_another_unit(median)}"
        )


def _in_another_unit(step: float) -> str:
    """What to do where a step would be one of 1 to 1000 Hz in a finer unit than s; nothing elsewhere."""
    for unit, seconds in (("ms", 1e-3), ("µs", 1e-6), ("ns", 1e-9)):
        if 1e-3 <= step * seconds <= 1.0:
            rate = 1 / (step * seconds)
            return f"; if they are in {unit}, give --time none --sample-rate {rate:.6g}"
    return ""


def _rate(
    path: Path, t: FloatArray, table: Table, given_hz: float | None, *, may_be_uneven: bool
) -> tuple[float, tuple[str, ...]]:
    """Sample rate in Hz (of the median step if uneven), and what to say about it.

    `given_hz` is taken where it is given; the stamps must agree with it.
    """
    if time_stamps.is_uniform(t):
        rate = time_stamps.mean_rate(t)
    elif may_be_uneven:
        rate = 1 / float(np.median(np.diff(t)))
    else:
        fault = time_stamps.first_step_change(t)
        before, here = np.diff(t)[fault - 2 : fault]
        raise InputError(
            f"{path}: {table.place(fault)}: time step changes from {before:.4g} s to {here:.4g} s; "
            "give --resample RATE (in Hz) to put the record on a uniform grid"
        )
    if given_hz is None or given_hz == rate:
        return rate, ()
    if not abs(rate / given_hz - 1) <= RATE_TOLERANCE:
        raise InputError(
            f"{path}: the time stamps say {rate:.6g} Hz, --sample-rate says {given_hz:g} Hz; "
            "correct one, or give --time none to ignore the stamps"
        )
    return given_hz, (f"taken at the given {given_hz:g} Hz, the time stamps saying {rate:.8g} Hz",)


def _check_gaps(path: Path, t: FloatArray, table: Table) -> None:
    ends = time_stamps.gaps(t)
    missing = t[ends] - t[ends - 1]
    share = float(missing.sum() / (t[-1] - t[0]))
    if share > MOST_GAPS:
        longest = int(missing.argmax())
        raise InputError(
            f"{path}: {table.place(int(ends[longest]))}: a gap of {missing[longest]:.4g} s; gaps are "
            f"{100 * share:.0f} % of the record: cut it into parts without them"
        )


def _resampled(
    path: Path, t: FloatArray, u: FloatArray, y: FloatArray, rate_hz: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    try:
        columns = resample_columns(t, u, y, rate_hz)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    if len(columns[0]) < FEWEST_SAMPLES:
        raise InputError(
            f"{path}: --resample {rate_hz:g} leaves {len(columns[0])} samples of the "
            f"{FEWEST_SAMPLES} that a record needs; give a higher rate"
        )
    return columns
