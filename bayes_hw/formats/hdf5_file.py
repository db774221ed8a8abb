"""Reading vectors from HDF5 files, MATLAB files of version 7.3 among them.

Only plain one-dimensional data sets of numbers that lie in the file itself are read: no external or virtual
storage, no external links, no references. Their declared size is checked before anything is read.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from itertools import islice
from pathlib import Path

import h5py
import numpy as np

from bayes_hw.errors import InputError
from bayes_hw.formats.hdf5_probe import is_sound_hdf5
from bayes_hw.formats.header import is_time_name
from bayes_hw.formats.matlab_elements import refuse_object
from bayes_hw.formats.table import Column, Table, numbers, refuse_infinite, stated_unit

MOST_BYTES = 256 * 2**20
"""Largest size of one data set, or of one of its chunks, inflated, in bytes."""

MOST_NAMES = 200
DEEPEST = 4
"""Groups within groups whose data sets are listed."""
SIGNATURE = b"\x89HDF\r\n\x1a\n"
MATLAB_BLOCK = 512
"""Bytes before the HDF5 part of a MATLAB file of version 7.3."""


def is_hdf5(path: Path) -> bool:
    """Whether the file begins as HDF5, or as MATLAB of version 7.3, does. Raises OSError if unreadable."""
    with path.open("rb") as stream:
        head = stream.read(MATLAB_BLOCK + len(SIGNATURE))
    return head.startswith(SIGNATURE) or head[MATLAB_BLOCK:] == SIGNATURE


def read_hdf5(path: Path, wanted: Sequence[str], *, most_rows: int, text: Collection[str] = ()) -> Table:
    """Read the data sets named in `wanted`, at most `most_rows` of each; "group.u" is "group/u".

    NaN is unmeasured; those of `text`, clocks, may hold text. A data set beside which another is named as
    a clock
    comes with those stamps where `text` are not of its length.

    Raises InputError on a file that is no sound HDF5 file, and on a data set that is not a vector of finite
    real numbers or larger than `MOST_BYTES`. Raises OSError when the file cannot be read.
    """
    with path.open("rb"):
        pass
    if not is_sound_hdf5(path, only=wanted):
        raise InputError(f"{path}: is not a sound HDF5 file; write it again")
    try:
        with h5py.File(path, "r") as file:
            found = {name: _dataset(path, file, name) for name in wanted}
            for name, class_name in _objects(file).items():
                if name in wanted or not all(one is not None for one in found.values()):
                    raise refuse_object(path, name, class_name)
            values = {
                name: _vector(path, name, dataset, most_rows, is_text=name in text)
                for name, dataset in found.items()
                if dataset is not None
            }
            beside = {
                name: clock
                for name, dataset in found.items()
                if dataset is not None and name not in text and (clock := _clock_beside(dataset)) is not None
            }
            clocks = {
                name: _vector(path, name, clock, most_rows, is_text=True) for name, clock in beside.items()
            }
            clock_units = {name: unit for name, clock in beside.items() if (unit := _unit(clock)) is not None}
            names = _names(file)
            units = {
                name: unit
                for name, dataset in found.items()
                if dataset is not None and (unit := _unit(dataset)) is not None
            }
    except InputError:
        raise
    except Exception:
        # h5py raises nearly every built-in exception on damaged files.
        raise InputError(f"{path}: is not a sound HDF5 file; write it again") from None
    return Table(
        values=values,
        missing=tuple(name for name in wanted if name not in values),
        names=names,
        kind="data set",
        place=lambda index: f"sample {index + 1}",
        units=units,
        clocks=clocks,
        clock_units=clock_units,
    )


def _objects(file: h5py.File) -> dict[str, str]:
    """The class of every object of MATLAB's at the top: its data set holds references, not its numbers."""
    found: dict[str, str] = {}
    for name in list(file)[:MOST_NAMES]:
        if isinstance(file.get(name, getlink=True), h5py.HardLink):
            attributes = file[name].attrs
            if "MATLAB_object_decode" in attributes and "MATLAB_class" in attributes:
                class_name = bytes(attributes["MATLAB_class"])[:64].decode("latin-1")
                if (name + class_name.replace(".", "_")).isidentifier():
                    found[name] = class_name
    return found


def _clock_beside(dataset: h5py.Dataset) -> h5py.Dataset | None:
    """The data set of the same group, not the file itself, that is named as a clock."""
    group = dataset.parent
    if group.name == "/" or len(group) > MOST_NAMES:
        return None
    for name in group:
        if is_time_name(name) and isinstance(group.get(name, getlink=True), h5py.HardLink):
            clock = group[name]
            if (
                isinstance(clock, h5py.Dataset)
                and clock.name != dataset.name
                and clock.shape == dataset.shape
            ):
                return clock
    return None


def _unit(dataset: h5py.Dataset) -> str | None:
    """The unit in the attribute `units` or `unit` of a data set."""
    for name in ("units", "unit"):
        if name in dataset.attrs:
            return stated_unit(dataset.attrs[name])
    return None


def _dataset(path: Path, file: h5py.File, name: str) -> h5py.Dataset | None:
    """The data set of this name, reached by hard links alone; None where there is none."""
    if "\0" in name:
        return None
    place: h5py.Group | h5py.Dataset = file
    parts = name.split("/") if name in file or "." not in name else name.split(".")
    for part in filter(None, parts):
        if not isinstance(place, h5py.Group) or part not in place:
            return None
        if not isinstance(place.get(part, getlink=True), h5py.HardLink):
            raise InputError(f"{path}: data set {name!r} is a link; write the numbers into the file itself")
        place = place[part]
    return place if isinstance(place, h5py.Dataset) else None


def _vector(path: Path, name: str, dataset: h5py.Dataset, most_rows: int, *, is_text: bool) -> Column:
    def refusal(said: str) -> InputError:
        return InputError(f"{path}: data set {name!r} {said}")

    if dataset.dtype.kind not in "iuf" and not (is_text and dataset.dtype.kind in "OS"):
        raise refusal("does not hold real numbers; name a vector of numbers")
    if dataset.is_virtual or dataset.external:
        raise refusal("lies in other files; write the numbers into the file itself")
    shape = tuple(int(size) for size in dataset.shape or ())
    if not shape or sum(size != 1 for size in shape) > 1:
        raise refusal(f"is {' x '.join(map(str, shape[:4])) or 'a scalar'}; name a vector")
    width = max(dataset.dtype.itemsize, 8)
    for size in (math.prod(shape), math.prod(dataset.chunks or (0,))):
        if size * width > MOST_BYTES:
            raise refusal(
                f"takes {size * width / 2**20:.0f} MB, more than the {MOST_BYTES // 2**20} MB that are read; "
                "cut the record into parts"
            )
    first = tuple(slice(most_rows) for _ in shape)
    if dataset.dtype.kind in "OS":
        if h5py.check_string_dtype(dataset.dtype) is None:
            raise refusal("does not hold real numbers; name a vector of numbers")
        return np.array(dataset.asstr()[first].ravel(), dtype=np.str_)
    values = numbers(dataset[first]).ravel()
    refuse_infinite(path, name, "data set", values, lambda index: f"sample {index + 1}")
    return values if is_text else values.astype(np.float64)


def _names(file: h5py.File) -> tuple[str, ...]:
    """Names at the top of the file and up to DEEPEST groups down, at most MOST_NAMES."""
    return tuple(_names_within(file, DEEPEST))


def _names_within(group: h5py.Group, depth: int) -> list[str]:
    found: list[str] = []
    for name in islice(group, MOST_NAMES):
        inner = group.get(name) if isinstance(group.get(name, getlink=True), h5py.HardLink) else None
        if isinstance(inner, h5py.Group) and depth:
            found += [f"{name}.{part}" for part in _names_within(inner, depth - 1)]
        else:
            found.append(name)
        if len(found) >= MOST_NAMES:
            return found[:MOST_NAMES]
    return found
