"""Headers of channels that each have a clock of their own: a property a row, its name and value by turns.

TwinCAT Scope writes such files: lines `Name`, `Data-Type`, `SampleTime[ms]`, `Unit` and others, each key
repeated before the value of every channel, then rows of a time in ms and a value by turns.
"""

from __future__ import annotations

from collections.abc import Sequence

LEAST_ROWS = 3
"""Properties from which on such a block is no accident."""

NAME, UNIT = "name", "unit"


def paired_header(rows: Sequence[Sequence[str]], columns: int) -> tuple[list[str], list[str]] | None:
    """Names and units of the columns (times and values by turns), None where `rows` are no such header.

    The first clock is called "time", the others after their channel; a repeated key is that of the last row.
    """
    properties = {}
    for row in rows:
        keys = {cell.strip().lower() for cell in row[0:columns:2]}
        if columns >= 2 and columns % 2 == 0 and len(row) >= columns - 1 and len(keys) == 1 and keys != {""}:
            values = [cell.strip() for cell in row[1:columns:2]]
            properties[keys.pop()] = values + [""] * (columns // 2 - len(values))
    named = properties.get(NAME, [])
    if len(properties) < LEAST_ROWS or not named or not all(named):
        return None
    names, units = [], []
    for number, (name, unit) in enumerate(zip(named, properties.get(UNIT, [""] * len(named)), strict=True)):
        names += ["time" if number == 0 else f"{name} time", name]
        units += ["ms", unit.strip("[]()")]
    return names, units
