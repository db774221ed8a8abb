"""One process at a time in an output folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from bayes_hw.errors import InputError
from bayes_hw.files import check_output_folder

try:
    import fcntl
except ImportError:  # not on Windows
    fcntl = None  # type: ignore[assignment]


@contextmanager
def claimed_folder(folder: Path) -> Iterator[None]:
    """Hold `folder` for this process until the block ends; the folder is made, and removed if left empty.

    The lock is the system's own on the folder itself (flock): it leaves no file behind and ends with the
    process, however that ends. Where the system has none, as on some network drives, nothing is held. Raises
    InputError when another process holds the folder, or when it cannot be written.
    """
    check_output_folder(folder)
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be made ({error.strerror}); give another --out") from None
    handle = os.open(folder, os.O_RDONLY) if fcntl is not None else None
    try:
        if handle is not None:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(
                    f"{folder}: another bayes-hw is writing there; wait until it ends, or give another --out"
                ) from None
            except OSError:
                pass
        yield
    finally:
        for path in made:
            with suppress(OSError):
                path.rmdir()
        if handle is not None:
            os.close(handle)
