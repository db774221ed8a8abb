"""Writing HDF5 so that a full disk costs one file and not the process.

The library writes much of a file when it is closed; where the disk is full then, it leaves its objects open
and the process ends in a segmentation fault. So a file is made in memory and written as any other bytes.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import h5py

from bayes_hw.files import write_bytes_atomically


@contextmanager
def hdf5_written_atomically(path: Path) -> Iterator[h5py.File]:
    """A new HDF5 file in memory that becomes `path` when the block ends without an error.

    Raises InputError when the folder cannot be written, OSError when the disk is full.
    """
    memory = io.BytesIO()
    with h5py.File(memory, "w") as file:
        yield file
    write_bytes_atomically(path, memory.getvalue())
