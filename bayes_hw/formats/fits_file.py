"""Reading columns of FITS binary tables, with astropy (the extra `fits`)."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.header import is_time_name, matches
from bayes_hw.formats.table import Column, Table, numbers, refuse_infinite, stated_unit

MOST_TABLES = 64


def astropy_fits(path: Path) -> ModuleType:
    """astropy's module for FITS; raises InputError that names the extra where it is not installed."""
    try:
        from astropy.io import fits
    except ImportError:
        raise InputError(
            f"{path}: FITS files need astropy; pip install 'bayes-hw[fits]', or give CSV, .mat or .h5"
        ) from None
    return fits


def read_fits(path: Path, wanted: Sequence[str], *, most_rows: int) -> Table:
    """Read the columns that `wanted` names from the first binary table that has most of them.

    A column that another table of the file has comes with the clock of that table. Units are those of TUNITn.
    Raises InputError on a file that is no sound FITS file, or a column that is no vector of numbers.
    """
    fits = astropy_fits(path)
    with path.open("rb") as stream:
        if stream.read(6) != b"SIMPLE":
            raise InputError(f"{path}: is not a sound FITS file; write it again, not compressed")
    try:
        with warnings.catch_warnings(), path.open("rb") as stream:
            warnings.simplefilter("ignore")
            with fits.open(stream, memmap=False, lazy_load_hdus=False) as file:
                return _table(path, fits, file, wanted, most_rows)
    except InputError:
        raise
    except Exception:
        # astropy raises OSError, ValueError, KeyError, VerifyError and more on damaged files.
        raise InputError(f"{path}: is not a sound FITS file; write it again") from None


def _table(path: Path, fits: Any, file: Any, wanted: Sequence[str], most_rows: int) -> Table:
    size = path.stat().st_size
    tables = [hdu for hdu in file[:MOST_TABLES] if isinstance(hdu, fits.BinTableHDU)]
    for hdu in tables:
        if int(hdu.header["NAXIS1"]) * int(hdu.header["NAXIS2"]) + int(hdu.header.get("PCOUNT", 0)) > size:
            raise InputError(
                f"{path}: is cut short: a table states more rows than the file holds; write it again"
            )
    if not tables:
        raise InputError(f"{path}: holds no binary table; write the record as one")
    names = tuple(dict.fromkeys(str(name) for hdu in tables for name in hdu.columns.names))
    best = max(tables, key=lambda hdu: sum(bool(matches(hdu.columns.names, name)) for name in wanted))
    place = lambda index: f"row {index + 1}"  # noqa: E731
    values: dict[str, Column] = {}
    clocks: dict[str, Column] = {}
    units: dict[str, str] = {}
    clock_units: dict[str, str] = {}
    for name in wanted:
        for hdu in [best, *(other for other in tables if other is not best)]:
            found = matches(hdu.columns.names, name)
            if not found:
                continue
            values[name] = _column(path, hdu, found[0], most_rows)
            refuse_infinite(path, name, "column", values[name], place)
            if (unit := _unit(hdu, found[0])) is not None:
                units[name] = unit
            clock = [i for i, other in enumerate(hdu.columns.names) if is_time_name(other)]
            if hdu is not best and clock:
                clocks[name] = _column(path, hdu, clock[0], most_rows)
                if (unit := _unit(hdu, clock[0])) is not None:
                    clock_units[name] = unit
            break
    missing = tuple(name for name in wanted if name not in values)
    return Table(values, missing, names, "column", place, units, clocks, clock_units)


def _unit(hdu: Any, at: int) -> str | None:
    """TUNITn, or for a time without one, the header's TIMEUNIT; a scale of TIMESYS makes an MJD of days."""
    return stated_unit(hdu.columns[at].unit or "")


def _column(path: Path, hdu: Any, at: int, most_rows: int) -> Column:
    values = np.asarray(hdu.data.field(at))
    name = hdu.columns.names[at]
    if values.ndim > 1 and values.size == len(values):
        values = values.reshape(-1)
    if values.ndim != 1:
        raise InputError(
            f"{path}: column {name!r} holds {values.shape[1:]} numbers a row; give a column of one"
        )
    if values.dtype.kind in "US":
        return np.char.strip(values[:most_rows].astype(np.str_))
    if values.dtype.kind not in "iuf":
        raise InputError(f"{path}: column {name!r} does not hold real numbers; give a column of numbers")
    return numbers(values[:most_rows].astype(values.dtype.newbyteorder("=")))
