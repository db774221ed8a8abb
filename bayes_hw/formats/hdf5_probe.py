"""Trying an HDF5 file in a process of its own before it is opened in this one.

On damaged files the HDF5 library can loop for ever, where no signal of Python's reaches it, or crash. A child
process reads the attributes and numbers of the file first; only a file that it comes through is opened here.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from math import ceil
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]
PROBE_SECONDS = 6.0
"""Of the processor, for a file of no size; what a sound one takes does not grow when the machine is busy."""

PATIENCE = 10
"""Seconds of the clock waited for a second of the processor."""

BYTES_PER_SECOND = 20 * 2**20
MOST_ADDRESSES = 2**31
MOST_MEMORY = 960 * 2**20
"""Address space and memory of the child in bytes, where the system can limit them: a chunk that inflates to
more than it states would take any amount."""

MOST_NUMBERS = 2**25
"""A data set of more numbers is not tried, nor is it read later."""


def is_sound_hdf5(*paths: Path, only: Sequence[str] | None = None) -> bool:
    """Whether a child process can read the files in the time of the processor that their size allows.

    Of the numbers all, or those of the data sets named in `only`. It finds this package where it is, and
    nothing in the folder that it happens to run in.
    """
    seconds = PROBE_SECONDS + sum(path.stat().st_size for path in paths) / BYTES_PER_SECOND
    names = None if only is None else list(only)
    task = json.dumps({"files": [str(path.resolve()) for path in paths], "only": names, "seconds": seconds})
    command = [sys.executable, "-P", "-m", "bayes_hw.formats.hdf5_probe"]
    given = os.environ.get("PYTHONPATH", "")
    places = os.pathsep.join([str(PACKAGE.parent), *filter(None, given.split(os.pathsep))])
    environment = os.environ | {"PYTHONPATH": places}
    try:
        done = subprocess.run(
            command, timeout=PATIENCE * seconds, input=task.encode(), capture_output=True, env=environment
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


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


def main() -> int:
    """Exit status 0 for a file that can be read."""
    task = json.load(sys.stdin)
    with suppress(ImportError):  # not on Windows
        import resource

        most_of = {
            resource.RLIMIT_AS: MOST_ADDRESSES,
            resource.RLIMIT_DATA: MOST_MEMORY,
            resource.RLIMIT_CPU: ceil(task["seconds"]),
        }
        for kind, most in most_of.items():
            limits = [limit for limit in resource.getrlimit(kind) if limit != resource.RLIM_INFINITY]
            resource.setrlimit(kind, (min([most, *limits]),) * 2)
    try:
        for path in task["files"]:
            try_file(path, task["only"])
    except Exception:
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
