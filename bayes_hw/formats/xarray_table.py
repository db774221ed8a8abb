"""Columns of an xarray Dataset; xarray itself is not imported, whoever has one has it."""

from __future__ import annotations

from typing import Any

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.table import Column, Table, numbers, refuse_infinite, stated_unit


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
