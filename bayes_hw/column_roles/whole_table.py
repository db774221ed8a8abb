"""Every column of a file, with the clocks that stand beside some."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from bayes_hw.column_roles.roles import MOST_COLUMNS
from bayes_hw.errors import InputError
from bayes_hw.formats.header import is_time_name, quantity_of
from bayes_hw.formats.readers import read_table
from bayes_hw.formats.split_seconds import with_split_clocks
from bayes_hw.formats.table import Column, Table
from bayes_hw.formats.text_layout import is_value
from bayes_hw.log.resample import MOST_SAMPLES


def whole_table(path: Path) -> Table:
    """Every column, as numbers where it has them, else as text; clocks that stand in two of them too."""
    return with_split_clocks(_every_column(path))


def _every_column(path: Path) -> Table:
    names = read_table(path, ["1", "\0"], ["1"], most_rows=1).names
    names = names[: 4 * MOST_COLUMNS]
    try:
        return _numbers_in_text(path, read_table(path, list(names), list(names), most_rows=MOST_SAMPLES))
    except InputError:
        found: dict[str, Table] = {}
        for name in names:
            try:
                found[name] = read_table(path, [name], [name], most_rows=MOST_SAMPLES)
            except InputError:
                continue
        if not found:
            raise
        first = next(iter(found.values()))
        return replace(
            first,
            values={name: table.values[name] for name, table in found.items() if name in table.values},
            clocks={name: clock for table in found.values() for name, clock in table.clocks.items()},
            clock_units={n: unit for table in found.values() for n, unit in table.clock_units.items()},
            units={name: unit for table in found.values() for name, unit in table.units.items()},
        )


def with_own_clocks(path: Path, table: Table) -> Table:
    """The columns that are no stamps, each with the clock that stands beside it, where a file has them."""
    names = [name for name in table.values if not is_time_name(name)]
    try:
        found = read_table(path, names, [], most_rows=MOST_SAMPLES)
    except InputError:
        return table
    return replace(found, names=table.names)


def _numbers_in_text(path: Path, table: Table) -> Table:
    """With the columns of text that are no stamps read as numbers, such as sexagesimal angles, where all
    their cells are."""
    for name, values in table.values.items():
        if is_time_name(name) or not _begins_with_number(values):
            continue
        try:
            found = read_table(path, [name], [], most_rows=MOST_SAMPLES)
        except InputError:
            continue
        if name in found.values and np.isfinite(found.values[name]).any():
            table = replace(
                table,
                values={**table.values, name: found.values[name]},
                units={**table.units, **found.units},
            )
    return table


def _begins_with_number(values: Column) -> bool:
    """Whether the first cell of text that is not empty is a number, sexagesimal or with a unit."""
    if values.dtype.kind not in "UO":
        return False
    first = next((cell for cell in map(str, values) if cell.strip()), "")
    return is_value(first) or quantity_of(first) is not None
