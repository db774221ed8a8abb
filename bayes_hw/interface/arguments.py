"""What the functions of the interface are given, checked before anything is computed."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from operator import index
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.gap.effects.catalogue import known_labels
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def records_given(records: Record | Sequence[Record], name: str = "records") -> tuple[Record, ...]:
    """One record or several as a tuple; raises InputError where there is none, or anything else."""
    if not isinstance(records, Record) and not _is_list(records):
        raise InputError(f"{name}: is of type {type(records).__name__}; {_made_of(records)}")
    given: tuple[Any, ...] = (records,) if isinstance(records, Record) else tuple(records)
    for record in given:
        if not isinstance(record, Record):
            raise InputError(f"{name}: holds a {type(record).__name__}; {_made_of(record)}")
    if not given:
        raise InputError(f"{name}: is empty; give at least one record")
    return given


def _is_list(given: Any) -> bool:
    """Whether it is a sequence of what may be records; a table, an array or a path is none."""
    return (
        isinstance(given, Iterable)
        and not isinstance(given, (str, Record, Mapping))
        and (not hasattr(given, "columns") and not hasattr(given, "dtype"))
    )


def _made_of(given: Any) -> str:
    """How a record is made of what was given instead."""
    if isinstance(given, (str, os.PathLike)):
        return "give Record.read(path)"
    if hasattr(given, "columns"):
        return "give Record.from_dataframe(table)"
    if hasattr(given, "data_vars"):
        return "give Record.from_xarray(dataset)"
    if hasattr(given, "dtype"):
        return "give Record.from_arrays(t, u, y)"
    return "give what Record.read or Record.from_arrays returns"


def model_given(model: Any) -> HammersteinWiener:
    """The model, that of an answer which holds one, or that in the file of this path; raises InputError where
    there is none."""
    if isinstance(model, str | os.PathLike):
        return HammersteinWiener.read(Path(model))
    found = getattr(model, "model", model)
    if not isinstance(found, HammersteinWiener):
        raise InputError(
            f"model: is of type {type(model).__name__}; give a HammersteinWiener, such as "
            "identify(records).model"
        )
    return found


def generator(seed: int) -> np.random.Generator:
    """The random numbers of a seed; raises InputError unless it is a whole number, zero or more."""
    return np.random.default_rng(_whole("seed", seed, 0))


def threads(jobs: int | None) -> int:
    """So many threads, all cores where None; raises InputError where it is less than one."""
    return os.cpu_count() or 1 if jobs is None else _whole("jobs", jobs, 1)


def _whole(name: str, value: Any, least: int) -> int:
    try:
        number = index(value)
    except TypeError:
        number = least - 1
    if number < least or isinstance(value, bool):
        raise InputError(f"{name}: is {value!r}; give a whole number, {least} or more")
    return number


def struck(without: str | Sequence[str]) -> frozenset[str]:
    """Labels of the catalogue; raises InputError at one that is not in it."""
    labels = (without,) if isinstance(without, str) else tuple(without)
    known = known_labels()
    for label in labels:
        if label not in known:
            raise InputError(f"without: {label!r} is not in the catalogue; use one of {', '.join(known)}")
    return frozenset(labels)
