"""Trying an HDF5 file in a process of its own before it is opened in this one.

On damaged files the HDF5 library can loop for ever, where no signal of Python's reaches it, or crash. A child
process reads the attributes and numbers of the file first; only a file that it comes through is opened here.
"""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1]
PROBE_SECONDS = 6.0
BYTES_PER_SECOND = 20 * 2**20
MOST_ADDRESSES = 2**31
"""Address space of the child in bytes, where the system can limit it."""

MOST_NUMBERS = 2**25
"""A data set of more numbers is not tried, nor is it read later."""


def is_sound_hdf5(*paths: Path) -> bool:
    """Whether a child process can read the files in the time that their size allows.

    It finds this package where it is, and nothing in the folder that it happens to run in.
    """
    seconds = PROBE_SECONDS + sum(path.stat().st_size for path in paths) / BYTES_PER_SECOND
    files = [str(path.resolve()) for path in paths]
    command = [sys.executable, "-P", "-m", "bayes_hw.formats.hdf5_probe", *files]
    given = os.environ.get("PYTHONPATH", "")
    places = os.pathsep.join([str(PACKAGE.parent), *filter(None, given.split(os.pathsep))])
    environment = os.environ | {"PYTHONPATH": places}
    try:
        done = subprocess.run(
            command, timeout=seconds, stdin=subprocess.DEVNULL, capture_output=True, env=environment
        )
    except subprocess.TimeoutExpired:
        return False
    return done.returncode == 0


def try_file(path: str) -> None:
    """Read every attribute, and every data set of numbers that is not too large."""
    import h5py

    def try_item(_: str, item: h5py.Group | h5py.Dataset) -> None:
        for name in item.attrs:
            with suppress(TypeError, OSError):  # references to dimensions, which nobody reads
                item.attrs[name]
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "iuf" and item.size:
            chunk = 1
            for size in item.chunks or ():
                chunk *= size
            if max(item.size, chunk) <= MOST_NUMBERS and not (item.is_virtual or item.external):
                item[()]

    with h5py.File(path, "r") as file:
        try_item("/", file)
        file.visititems(try_item)


def main() -> int:
    """Exit status 0 for a file that can be read."""
    with suppress(ImportError):  # not on Windows
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MOST_ADDRESSES, MOST_ADDRESSES))
    try:
        for path in sys.argv[1:]:
            try_file(path)
    except Exception:
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
