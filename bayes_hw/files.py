"""Writing files so that a reader never sees half of one."""

from __future__ import annotations

import errno
import io
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError

MOST_SETTINGS_BYTES = 16 * 2**20
GIVE_A_MODEL = "give a model.json, as from bayes-hw identify"


@contextmanager
def temporary_sibling(path: Path) -> Iterator[Path]:
    """A temporary path beside `path` that takes its name when the block ends without an error.

    Of a link, what it leads to is written. Raises InputError when the folder cannot be written, or `path` is
    a folder, a device or a pipe.
    """
    path = _regular(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.stem[:60]}.", suffix=path.suffix, dir=path.parent)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); give another --out") from None
    os.close(handle)
    temporary = Path(name)
    try:
        with _named(path):
            yield temporary
        temporary.chmod(0o666 & ~_umask())
        try:
            temporary.replace(path)
        except OSError as error:
            raise InputError(f"{path}: cannot be written ({error.strerror}); give another --out") from None
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def staged(folder: Path, instead_of: Sequence[str] = ()) -> Iterator[Path]:
    """An empty folder whose files go to `folder` together, once the block ends without an error.

    So a full disk leaves the files of the run before, all of them. Files of the names `instead_of` are taken
    away where none of that name comes. Raises InputError when the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        place = Path(tempfile.mkdtemp(prefix=".staged.", dir=folder))
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); give another --out") from None
    try:
        try:
            yield place
        except OSError as error:
            if error.filename is not None and Path(error.filename).is_relative_to(place):
                error.filename = str(folder / Path(error.filename).relative_to(place))
            raise
        made = {path: _regular(folder / path.relative_to(place)) for path in _files(place)}
        for path, target in made.items():
            _move(path, target)
        for name in instead_of:
            if place / name not in made:
                (folder / name).unlink(missing_ok=True)
    finally:
        shutil.rmtree(place, ignore_errors=True)


def _files(folder: Path) -> list[Path]:
    return sorted(path for path in folder.rglob("*") if path.is_file())


def _move(path: Path, target: Path) -> None:
    """Rename, or where `target` lies on another disk, copy and rename."""
    target.parent.mkdir(parents=True, exist_ok=True)
    try:
        path.replace(target)
    except OSError as error:
        if error.errno != errno.EXDEV:
            raise InputError(f"{target}: cannot be written ({error.strerror}); give another --out") from None
        with temporary_sibling(target) as temporary:
            shutil.copyfile(path, temporary)


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """An OSError that names no file, as that of a full disk, names `path`."""
    try:
        yield
    except OSError as error:
        if error.filename is None:
            error.filename = str(path)
        raise


def _regular(path: Path) -> Path:
    """Where a file at `path` really lies; raises InputError where something else than a file is there."""
    try:
        real = Path(os.path.realpath(path))
        if not real.exists() or real.is_file():
            return real
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: cannot be written ({_said(error)}); give another --out") from None
    raise InputError(
        f"{path}: is {'a folder' if real.is_dir() else 'no regular file'}; give a file name with --out"
    )


def _said(error: OSError | ValueError) -> str:
    return str(getattr(error, "strerror", None) or error)


def check_output_folder(folder: Path) -> None:
    """Raise InputError unless `folder` can be written or made; makes nothing."""
    nearest = folder
    try:
        if "\0" in str(folder):
            raise ValueError("null character")
        while not nearest.exists() and nearest != nearest.parent:
            nearest = nearest.parent
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: cannot be written ({_said(error)}); give another --out") from None
    if not nearest.is_dir():
        raise InputError(f"{nearest}: is a file where a folder is to be; give another --out")
    if not os.access(nearest, os.W_OK | os.X_OK):
        raise InputError(f"{nearest}: no permission to write there; give another --out")


def check_output_file(path: Path, inputs: Sequence[Path], ending: str = "") -> None:
    """Raise InputError unless `path` has this ending, can be written and is none of the `inputs`; writes
    nothing."""
    check_output_folder(_regular(path).parent)
    if path.exists() and any(other.exists() and path.samefile(other) for other in inputs):
        raise InputError(f"{path}: would overwrite an input; give another --out")
    if not path.name.lower().endswith(ending):
        raise InputError(f"{path}: the result is a {ending[1:].upper()} file; give --out a name in {ending}")


def read_small_text(path: Path) -> str:
    """Text of a file of settings, in UTF-8. Raises InputError where it is no regular file or larger than
    MOST_SETTINGS_BYTES, OSError where it cannot be read, UnicodeDecodeError where it is not UTF-8."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: is not a regular file; give a JSON file")
    if path.stat().st_size > MOST_SETTINGS_BYTES:
        raise InputError(
            f"{path}: is larger than {MOST_SETTINGS_BYTES // 2**20} MB; give a JSON file of settings"
        )
    return path.read_text(encoding="utf-8")


def write_bytes_atomically(path: Path, content: bytes) -> None:
    """Write `content` under a temporary name, then rename it to `path`."""
    with temporary_sibling(path) as temporary:
        temporary.write_bytes(content)


def write_text_atomically(path: Path, content: str) -> None:
    """Write `content` as UTF-8 under a temporary name, then rename it to `path`."""
    write_bytes_atomically(path, content.encode("utf-8"))


def read_json(path: Path, remedy: str = "give a JSON file") -> Any:
    """What a JSON file of settings holds; raises InputError that ends in the remedy where it is none."""
    try:
        return json.loads(read_small_text(path))
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); {remedy}") from None
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: is not JSON ({error}); {remedy}") from None


def write_json(path: Path, content: Any, indent: int | None = 1) -> None:
    """Write `content`, all numbers finite, as JSON under a temporary name, then rename it to `path`."""
    write_text_atomically(path, json.dumps(content, indent=indent, allow_nan=False) + "\n")


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


ROWS = 2**16
"""Turned into text at once: the text of a long record takes ten times the memory of its numbers."""


def write_csv(path: Path, columns: Mapping[str, FloatArray]) -> None:
    """Write columns of equal length under their names, with all 17 digits of every number; NaN is empty."""
    table = list(columns.values())
    with temporary_sibling(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(columns) + "\n")
        for start in range(0, len(table[0]), ROWS):
            rows = np.column_stack([column[start : start + ROWS] for column in table])
            text = io.StringIO()
            np.savetxt(text, rows, fmt="%.17g", delimiter=",")
            file.write(text.getvalue().replace("nan", "") if np.isnan(rows).any() else text.getvalue())
