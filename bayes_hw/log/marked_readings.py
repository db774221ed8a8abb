"""Columns of a log without the readings that mean that nothing was measured."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.table import Table
from bayes_hw.reading_options import ReadingOptions
from bayes_hw.unmeasured import (
    ENDS,
    NOTHING,
    is_unmeasured,
    is_unmeasured_command,
    mark_of_angle,
    mark_of_command,
)


def without_marks(
    path: Path, table: Table, name: str, role: str, values: FloatArray, options: ReadingOptions
) -> FloatArray:
    """The values of a column, shape (samples,), NaN at the readings of `options.missing`.

    Raises InputError, naming the option, where others are such marks that nobody named.
    """
    missing = options.missing if role == "output" else [one for one in options.missing if one != ENDS]
    if set(missing) - {NOTHING}:
        told = is_unmeasured_command if role == "input" else is_unmeasured
        values = np.where(told(values, missing), np.nan, values)
    if NOTHING in options.missing or role not in ("input", "output"):
        return values
    is_angle = role == "output" or options.input_position is not None
    mark = (mark_of_angle(values) if is_angle else None) or mark_of_command(values)
    if mark is None:
        return values
    raise InputError(f"{path}: {table.place(mark.first)}, {table.kind} {name!r}: {mark}")
