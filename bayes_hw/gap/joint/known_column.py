"""A known input as the simulation takes it: counted from where the record begins, late by a lag."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError

NO_COLUMNS: Mapping[str, FloatArray] = MappingProxyType({})

BEGINNING = 10
"""Samples whose mean is the level that a record begins at: the axis rests there under it."""


def delayed_column(
    known: Mapping[str, FloatArray], name: str, lag: float, samples: int
) -> tuple[FloatArray, FloatArray]:
    """The column `name`, less its level at the beginning, `lag` samples late, and its derivative by the lag,
    both (samples,).

    Between its samples it is straight, before the first the level. Raises InputError where there is no such
    column.
    """
    if name not in known:
        raise InputError(
            f"the model has the known input {name!r}; say --known {name} with a record that has it"
        )
    column = known[name]
    counted = column - column[: min(BEGINNING, len(column))].mean()
    whole = int(np.floor(lag))
    share = lag - whole
    newer, older = _late(counted, whole, samples), _late(counted, whole + 1, samples)
    return (1 - share) * newer + share * older, older - newer


def _late(column: FloatArray, lag: int, samples: int) -> FloatArray:
    found = np.zeros(samples)
    if lag < samples:
        begin = max(lag, 0)
        part = column[begin - lag : samples - lag]
        found[begin : begin + len(part)] = part
        if lag < 0:
            found[len(part) :] = column[-1]
    return found
