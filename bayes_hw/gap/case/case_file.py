"""case.json: the files that a case names; light, so that a wrong one is refused at once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bayes_hw.errors import InputError
from bayes_hw.files import read_json

EXAMPLE = '{"model": "model.json", "train": ["train_1.csv"], "holdout": ["holdout.csv"]}'


@dataclass(frozen=True)
class CaseFile:
    """Model, records to train on and records held out, as paths."""

    model: Path
    train: tuple[Path, ...]
    holdout: tuple[Path, ...]


def read_case_file(folder: Path) -> CaseFile:
    """What case.json in `folder` names, relative to it. Raises InputError on anything wrong."""
    path = folder / "case.json"
    if folder.is_file():
        raise InputError(f"{folder}: is no case folder, which holds a case.json")
    data = read_json(path, "give a case folder")
    if not isinstance(data, dict) or not isinstance(data.get("model"), str):
        raise InputError(f'{path}: needs "model", "train" and "holdout", such as {EXAMPLE}')
    for key in ("train", "holdout"):
        if not isinstance(data.get(key), list) or not all(isinstance(item, str) for item in data[key]):
            raise InputError(f"{path}: {key}: must be a list of file names")
    train, holdout = (tuple(folder / item for item in data[key]) for key in ("train", "holdout"))
    return CaseFile(folder / data["model"], train, holdout)
