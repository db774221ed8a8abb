"""Columns of a record from arrays in memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.log import time_stamps

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
    if len(stamps) < 2 or time_stamps.first_not_increasing(stamps) is not None:
        raise InputError(f"record {name}: t does not increase; give times in s, or sample_rate_hz without t")
    if not time_stamps.is_uniform(stamps):
        raise InputError(
            f"record {name}: t is not uniform; put the columns on a uniform grid first, or write them to a "
            "file and read it with resample_hz"
        )
    rate = time_stamps.mean_rate(stamps)
    if sample_rate_hz is not None and not abs(rate / sample_rate_hz - 1) <= RATE_TOLERANCE:
        raise InputError(
            f"record {name}: t says {rate:.6g} Hz, sample_rate_hz says {sample_rate_hz:g} Hz; correct one, "
            "or leave t out"
        )
    return stamps, float(rate if sample_rate_hz is None else sample_rate_hz), command, angle


def _numbers(name: str, column: str, given: ArrayLike) -> FloatArray:
    try:
        values = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"record {name}: {column} holds what is no number; give numbers") from None
    if values.ndim != 1:
        raise InputError(f"record {name}: {column} has shape {values.shape}; give one value a sample")
    return values
