"""A set of blind cases on disk: DIR/cases/case_0000/..., the sealed truth DIR/truth.zip, and DIR/seal.json.

The truth is one zip of fixed time stamps with case_0000.json (faults, strengths, base parameters) and the
noise-free outputs case_0000_holdout.csv, case_0000_train_1.csv, ... of every case; where drift, glitches
or rounding come on top, case_0000_holdout_shown.csv has them too. set.json in it holds what the set was made
from, which would give the truth away, and the digest of the cases. The zip's SHA-256 is the seal, so that it
binds both.
"""

from __future__ import annotations

import hashlib
import json
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bayes_hw.errors import InputError
from bayes_hw.files import read_small_text, temporary_sibling, write_json

CASES, TRUTH, SEAL = "cases", "truth.zip", "seal.json"
ORIGIN = "set.json"
SCHEMA = "bayes-hw/blind/2"
ZIP_TIME = (1980, 1, 1, 0, 0, 0)


def case_name(index: int) -> str:
    """Folder name of a case."""
    return f"case_{index:04d}"


def case_folders(folder: Path) -> list[Path]:
    """The case folders of a set, in order; raises InputError where there are none."""
    found = sorted(path.parent for path in folder.glob("*/case.json"))
    if not found:
        raise InputError(f"{folder}: holds no case folders; give the --out folder of bayes-hw blind make")
    return found


def file_digest(path: Path) -> str:
    """SHA-256 of a file; raises InputError where it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None


def folder_digest(folder: Path, names: Sequence[str] | None = None) -> str:
    """SHA-256 over the names and contents of the files below `folder` (all, or those of these names)."""
    digest = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        if names is None or path.name in names:
            digest.update(f"{path.relative_to(folder).as_posix()}\0{file_digest(path)}\n".encode())
    return digest.hexdigest()


def write_truth(path: Path, files: Mapping[str, str]) -> str:
    """Write the truth as one zip that depends on the content alone; its SHA-256."""
    with (
        temporary_sibling(path) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name in sorted(files):
            archive.writestr(zipfile.ZipInfo(name, ZIP_TIME), files[name], zipfile.ZIP_DEFLATED, 6)
    return file_digest(path)


def read_truth(path: Path) -> dict[str, str]:
    """Every file of the truth by name; raises InputError when it cannot be opened."""
    try:
        with zipfile.ZipFile(path) as archive:
            return {name: archive.read(name).decode() for name in archive.namelist()}
    except (OSError, EOFError, NotImplementedError, ValueError, zipfile.BadZipFile, zlib.error) as error:
        raise InputError(f"{path}: is not a sealed truth ({error}); make the set again") from None


def write_seal(folder: Path, content: Mapping[str, Any]) -> None:
    """DIR/seal.json."""
    write_json(folder / SEAL, {"schema": SCHEMA, **content})


def read_seal(folder: Path) -> dict[str, Any]:
    """Content of DIR/seal.json; raises InputError where it is missing or damaged."""
    path = folder / SEAL
    try:
        content = json.loads(read_small_text(path))
    except OSError:
        raise InputError(f"{path}: no such file; give the --out folder of bayes-hw blind make") from None
    except (ValueError, RecursionError):
        raise InputError(f"{path}: is damaged; make the set again") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA or "sha256" not in content:
        raise InputError(f"{path}: is not a seal of this version; make the set again")
    return content
