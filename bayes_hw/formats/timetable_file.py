"""Reading timetables and tables of MATLAB's, objects that only mat-io (the extra `matlab`) opens.

Every file is read in a process of its own first, with limits on time and memory (`probe`).
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.header import matches
from bayes_hw.formats.probe import comes_through, run_limited
from bayes_hw.formats.table import Column, Table, numbers, refuse_infinite, stated_unit

if TYPE_CHECKING:
    import pandas as pd

PROBE_SECONDS, BYTES_PER_SECOND = 10.0, 10 * 2**20
"""Of the processor, for a file of no size, and for larger ones."""


def can_read_timetables() -> bool:
    """Whether mat-io is installed."""
    from importlib.util import find_spec

    return find_spec("matio") is not None


def read_timetable(
    path: Path, name: str, wanted: Sequence[str], clocks: Sequence[str], *, most_rows: int
) -> Table:
    """The columns `wanted` of the file's timetable or table `name`, at most `most_rows` rows.

    The row times of a timetable are its column of that name (usually Time), and the one meant where the first
    of `clocks` is no column; dates are int64 in ns, durations in s. Units are those that the timetable states
    (VariableUnits). Raises InputError on a file that mat-io cannot read within the limits, and on a column
    that holds infinite numbers.
    """
    seconds = PROBE_SECONDS + path.stat().st_size / BYTES_PER_SECOND
    task = {"file": str(path.resolve()), "name": name}
    if not comes_through("bayes_hw.formats.timetable_file", task, seconds):
        raise InputError(
            f"{path}: variable {name!r} cannot be read; type writetimetable({name}, '{path.stem}.csv') in "
            f"MATLAB and give {path.stem}.csv"
        )
    frame = load_frame(str(path), name)
    columns, units = _columns(frame)
    names = tuple(columns)
    found = {asked: names[at[0]] for asked in wanted if (at := matches(names, asked))}
    for clock in clocks[:1]:
        if clock in wanted and clock not in found and _has_row_times(frame):
            found[clock] = names[0]
    values = {asked: columns[name][:most_rows] for asked, name in found.items()}
    for asked, column in values.items():
        refuse_infinite(path, asked, "column", column, _place)
    return Table(
        values,
        tuple(asked for asked in wanted if asked not in found),
        names,
        "column",
        _place,
        {asked: units[name] for asked, name in found.items() if name in units},
    )


def load_frame(path: str, name: str) -> pd.DataFrame:
    """The data frame of one variable; raises ValueError where it is none, and whatever mat-io raises."""
    import matio
    import pandas as pd

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        frame = matio.load_from_mat(path, variable_names=[name], add_table_attrs=True)[name]
    if not isinstance(frame, pd.DataFrame):
        raise ValueError(f"{name} is no table")
    return frame


def _has_row_times(frame: pd.DataFrame) -> bool:
    return frame.index.dtype.kind in "mM"


def _columns(frame: pd.DataFrame) -> tuple[dict[str, Column], dict[str, str]]:
    """Columns by name, row times first, and the units that they state."""
    columns: dict[str, Column] = {}
    units: dict[str, str] = {}

    def take(name: str, cells: np.ndarray[Any, Any]) -> None:
        if cells.dtype.kind in "mM":
            columns[name] = _times(cells)
        elif cells.dtype.kind in "OUT":
            columns[name] = np.array([str(cell) for cell in cells], dtype=np.str_)
        else:
            columns[name] = numbers(cells)
        if cells.dtype.kind == "M":
            units[name] = "ns"

    if _has_row_times(frame):
        take(str(frame.index.name or "Time"), frame.index.to_numpy())
    stated = frame.attrs.get("varUnits", frame.attrs.get("VariableUnits", ()))
    for number, name in enumerate(str(column) for column in frame.columns):
        cells = frame.iloc[:, number].to_numpy()
        if cells.ndim != 1 or cells.dtype.kind not in "iufbMmOUT":
            continue
        take(name, cells)
        if len(stated) == frame.shape[1] and (unit := stated_unit(_text(stated[number]))) is not None:
            units[name] = unit
    return columns, units


def _times(stamps: np.ndarray[Any, Any]) -> Column:
    """Dates as int64 in ns, durations in s."""
    if stamps.dtype.kind == "M":
        return np.asarray(stamps.astype("datetime64[ns]").astype(np.int64))
    return np.asarray(stamps.astype("timedelta64[ns]").astype(np.int64) * 1e-9)


def _text(cell: object) -> object:
    """A unit as text, however deep MATLAB's cells hold it."""
    while isinstance(cell, np.ndarray) and cell.size == 1:
        cell = cell.ravel()[0]
    return cell


def _place(index: int) -> str:
    return f"row {index + 1}"


def try_timetable(task: Mapping[str, Any]) -> None:
    """What the child does."""
    _columns(load_frame(task["file"], task["name"]))


if __name__ == "__main__":
    sys.exit(run_limited(try_timetable))
