"""Columns of a pandas DataFrame; pandas itself is not imported, whoever has one has it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bayes_hw.formats.table import Column, Table, numbers, refuse_infinite

if TYPE_CHECKING:
    import pandas as pd
from typing import Any

from bayes_hw.errors import InputError
from bayes_hw.formats.table import stated_unit


def table_of_dataframe(table: pd.DataFrame, time: str | None) -> Table:
    """Every column of numbers, text or dates; an index that has a name, or holds dates, durations or numbers
    that are not whole, stands for the column `time` where there is no such column.

    Raises InputError where two columns have one name.
    """
    twice = table.columns[table.columns.duplicated()]
    if len(twice):
        raise InputError(f"table: column {str(twice[0])!r} is there twice; rename one of them")
    columns = {str(name): table[name] for name in table.columns}
    is_clock = table.index.dtype.kind in "Mmf" or table.index.name is not None
    if time is not None and time not in columns and is_clock:
        columns[time] = table.index.to_series()
    values: dict[str, Column] = {}
    units: dict[str, str] = {}
    place = lambda index: f"row {index + 1}"  # noqa: E731
    for name, column in columns.items():
        zone = getattr(column.dtype, "tz", None)
        array = np.asarray(column if zone is None else column.dt.tz_convert(None))
        if array.dtype.kind in "Mm":
            units[name] = "ns"
            array = array.astype(f"{array.dtype.kind}8[ns]").astype(np.int64)
        try:
            values[name] = numbers(array)
        except (TypeError, ValueError):
            values[name] = array.astype(np.str_)
        refuse_infinite("table", name, "column", values[name], place)
    return Table(values, (), tuple(columns), "column", place, units)


def table_of_xarray(dataset: Any) -> Table:
    """Every variable and coordinate of one dimension; raises InputError where the dataset holds none."""
    values: dict[str, Column] = {}
    units: dict[str, str] = {}
    place = lambda index: f"sample {index + 1}"  # noqa: E731
    for name, variable in {**dict(dataset.coords), **dict(dataset.data_vars)}.items():
        array = np.asarray(variable.values)
        if array.ndim != 1 or array.dtype.kind not in "iufMU":
            continue
        is_date = array.dtype.kind == "M"
        column = array.astype("datetime64[ns]").astype(np.int64) if is_date else array
        values[str(name)] = column if column.dtype.kind == "U" else numbers(column)
        refuse_infinite("dataset", str(name), "variable", values[str(name)], place)
        unit = "ns" if is_date else stated_unit(variable.attrs.get("units", variable.attrs.get("unit", "")))
        if unit is not None:
            units[str(name)] = unit
    if not values:
        raise InputError("dataset: holds no variable of one dimension; select one axis")
    return Table(values, (), tuple(values), "variable", place, units)
