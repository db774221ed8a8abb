"""Columns of a record from arrays in memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.formats.table import Table
from bayes_hw.log import time_stamps
from bayes_hw.python_words import python_words
from bayes_hw.record_checks import clock_change
from bayes_hw.unmeasured import mark_of_angle, mark_of_command

RATE_TOLERANCE = 0.01
"""Largest relative difference between a given sample rate and that of the time stamps."""


def uniform_columns(
    name: str,
    t: ArrayLike | None,
    u: ArrayLike | None,
    y: ArrayLike | None,
    sample_rate_hz: float | None,
) -> tuple[FloatArray, float, FloatArray, FloatArray | None]:
    """Time (s), rate (Hz), command and angle of a record; raises InputError where they do not make one."""
    if u is None:
        raise InputError(f"record {name}: no command; give t, u, y in this order, or u=... and y=... by name")
    command = _numbers(name, "u", u)
    angle = None if y is None else _numbers(name, "y", y)
    if t is None:
        if sample_rate_hz is None or not sample_rate_hz > 0:
            raise InputError(f"record {name}: neither time nor rate; give t=..., or sample_rate_hz in Hz")
        return np.arange(len(command)) / sample_rate_hz, float(sample_rate_hz), command, angle
    stamps = _numbers(name, "t", t)
    mark = (None if angle is None else mark_of_angle(angle)) or mark_of_command(command)
    if mark is not None:
        raise InputError(python_words(f"record {name}: sample {mark.first + 1}: {mark}"))
    change = clock_change(stamps)
    if change is not None:
        raise InputError(python_words(f"record {name}: sample {change.first + 1}: {change}"))
    if len(stamps) < 2 or time_stamps.first_not_increasing(stamps) is not None:
        raise InputError(f"record {name}: t does not increase; give times in s, or sample_rate_hz without t")
    if not time_stamps.is_uniform(stamps):
        raise InputError(
            f"record {name}: t is not uniform; give options=ReadingOptions(resample_hz=RATE), or in it, "
            'where samples are missing, gaps="bridge" or gaps="split"'
        )
    rate = time_stamps.mean_rate(stamps)
    if sample_rate_hz is not None and not abs(rate / sample_rate_hz - 1) <= RATE_TOLERANCE:
        raise InputError(
            f"record {name}: t says {rate:.6g} Hz, sample_rate_hz says {sample_rate_hz:g} Hz; correct one, "
            "or leave t out"
        )
    return stamps, float(rate if sample_rate_hz is None else sample_rate_hz), command, angle


def table_of_arrays(name: str, t: ArrayLike | None, u: ArrayLike | None, y: ArrayLike | None) -> Table:
    """Arrays as the columns t, u, y of a table; raises InputError where one is no column of numbers."""
    given = {"t": t, "u": u, "y": y}
    values = {column: _numbers(name, column, array) for column, array in given.items() if array is not None}
    return Table(values, (), tuple(values), "column", lambda index: f"sample {index + 1}")


def _numbers(name: str, column: str, given: ArrayLike) -> FloatArray:
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"record {name}: {column} holds what is no number; give numbers") from None
    if values.ndim != 1:
        raise InputError(f"record {name}: {column} has shape {values.shape}; give one value a sample")
    return values
