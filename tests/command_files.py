"""Files that the tests of the command line work on."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
from simulated_records import measured

from bayes_hw.files import write_csv
from bayes_hw.identify import four_steps
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

SAMPLES = 400


def write_record(path: Path, record: Record) -> Path:
    """Write `record` as t,u,y."""
    write_csv(path, {"t": record.t, "u": record.u, "y": record.y})
    return path


def write_axis(folder: Path, axis: HammersteinWiener) -> Path:
    """model/model.json, train_1.csv, train_2.csv and holdout.csv of one axis in `folder`."""
    axis.write(folder / "model" / "model.json")
    for seed, name in enumerate(("train_1", "train_2", "holdout"), start=1):
        write_record(folder / f"{name}.csv", measured(axis, SAMPLES, seed=seed))
    return folder


def copied_axis(made: Path, folder: Path) -> Path:
    """What `write_axis` wrote in `made`, again in `folder`."""
    return Path(shutil.copytree(made, folder, dirs_exist_ok=True))


def few_orders(patch: pytest.MonkeyPatch) -> None:
    """Three poles are looked for, as many as the small axis has, unless others are asked for."""
    defaults = four_steps.identify.__kwdefaults__
    assert defaults is not None
    patch.setitem(defaults, "max_order", 3)


def changed_model(folder: Path, changes: Mapping[str, Any]) -> Path:
    """A copy of model/model.json with the values under dotted keys replaced."""
    content = json.loads((folder / "model" / "model.json").read_text())
    for key, value in changes.items():
        *parents, last = key.split(".")
        place = content
        for parent in parents:
            place = place[parent]
        place[last] = value
    path = folder / "changed.json"
    path.write_text(json.dumps(content))
    return path


def files_below(folder: Path) -> set[str]:
    """Every file and folder in `folder`, as paths relative to it."""
    return {str(path.relative_to(folder)) for path in folder.rglob("*")}
