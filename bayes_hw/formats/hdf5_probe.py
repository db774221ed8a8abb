"""Trying an HDF5 file in a process of its own before it is opened in this one.

On damaged files the HDF5 library can loop for ever, where no signal of Python's reaches it, or crash. A child
process reads the attributes and numbers of the file first; only a file that it comes through is opened here.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from bayes_hw.formats.probe import comes_through, run_limited

PROBE_SECONDS = 6.0
"""Of the processor, for a file of no size; what a sound one takes does not grow when the machine is busy."""

BYTES_PER_SECOND = 20 * 2**20
MOST_NUMBERS = 2**25
"""A data set of more numbers is not tried, nor is it read later."""


def is_sound_hdf5(*paths: Path, only: Sequence[str] | None = None) -> bool:
    """Whether a child process can read the files in the time of the processor that their size allows.

    Of the numbers all, or those of the data sets named in `only`.
    """
    seconds = PROBE_SECONDS + sum(path.stat().st_size for path in paths) / BYTES_PER_SECOND
    task = {
        "files": [str(path.resolve()) for path in paths],
        "only": None if only is None else list(only),
    }
    return comes_through("bayes_hw.formats.hdf5_probe", task, seconds)


def try_file(path: str, only: Sequence[str] | None) -> None:
    """Read every attribute, and the numbers of every data set, or of those named in `only`, not too large.

    "group.u" is a data set of that name, or the data set u of a group.
    """
    import h5py

    def try_numbers(item: h5py.Group | h5py.Dataset | None) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "iuf" and item.size:
            chunk = 1
            for size in item.chunks or ():
                chunk *= size
            if max(item.size, chunk) <= MOST_NUMBERS and not (item.is_virtual or item.external):
                item[()]

    def try_item(_: str, item: h5py.Group | h5py.Dataset) -> None:
        for name in item.attrs:
            with suppress(TypeError, OSError):  # references to dimensions, which nobody reads
                item.attrs[name]
        if only is None:
            try_numbers(item)

    with h5py.File(path, "r") as file:
        try_item("/", file)
        file.visititems(try_item)
        for name in only or ():
            for place in (name, name.replace(".", "/")):
                try_numbers(file.get(place))


def try_files(task: Mapping[str, Any]) -> None:
    """What the child does."""
    for path in task["files"]:
        try_file(path, task["only"])


if __name__ == "__main__":
    sys.exit(run_limited(try_files))
