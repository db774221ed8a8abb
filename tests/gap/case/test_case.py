"""A case folder: read whole, or refused in one line that names the place and the remedy."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from command_files import write_axis, write_record
from simulated_records import measured

from bayes_hw.errors import InputError
from bayes_hw.gap.case.case import Case
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

GOOD: dict[str, Any] = {
    "model": "model/model.json",
    "train": ["train_1.csv", "train_2.csv"],
    "holdout": ["holdout.csv"],
}


@pytest.fixture
def folder(small_axis: HammersteinWiener, tmp_path: Path) -> Path:
    """A good case."""
    write_axis(tmp_path, small_axis)
    (tmp_path / "case.json").write_text(json.dumps(GOOD))
    return tmp_path


def test_a_good_case(folder: Path, small_axis: HammersteinWiener) -> None:
    case = Case.read(folder)
    assert case.name == folder.name
    assert [record.name for record in case.train] == ["train_1", "train_2"]
    assert [record.name for record in case.holdout] == ["holdout"]
    assert case.model.sample_rate_hz == small_axis.sample_rate_hz
    assert all(record.units == case.model.units for record in (*case.train, *case.holdout))


def content(**changes: Any) -> Callable[[Path], None]:
    """Writes case.json with keys changed; None leaves a key out."""
    data = {key: value for key, value in (GOOD | changes).items() if value is not None}
    return lambda folder: _write(folder, json.dumps(data))


def _write(folder: Path, text: str) -> None:
    (folder / "case.json").write_text(text)


def _other_rate(folder: Path) -> None:
    model = HammersteinWiener.read(folder / "model" / "model.json")
    record = measured(model, 400, seed=5)
    write_record(folder / "train_1.csv", replace(record, t=2 * record.t, sample_rate_hz=10.0))


def _too_short(folder: Path) -> None:
    lines = (folder / "holdout.csv").read_text().splitlines()
    (folder / "holdout.csv").write_text("\n".join(lines[:100]) + "\n")


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (
            lambda folder: (folder / "case.json").unlink(),
            r"case\.json: cannot be read .*; give a case folder",
        ),
        (lambda folder: _write(folder, "{"), r"case\.json: is not JSON"),
        (lambda folder: _write(folder, "[" * 100_000), r"case\.json: is not JSON"),
        (lambda folder: _write(folder, "[]"), 'needs "model"'),
        (content(model=None), 'needs "model"'),
        (content(model=3), 'needs "model"'),
        (content(train=None), "train: must be a list of file names"),
        (content(holdout="holdout.csv"), "holdout: must be a list of file names"),
        (content(train=[1]), "train: must be a list of file names"),
        (content(train=[]), "no record to train on; give at least one"),
        (content(holdout=[]), "no record held out; give one"),
        (content(model="no.json"), r"no\.json: cannot be read"),
        (content(train=["no.csv"]), r"no\.csv"),
        (_other_rate, "sampled at 10 Hz, the model at 20 Hz; resample"),
        (_too_short, "holdout: 99 samples; give 200 or more"),
    ],
)
def test_a_bad_case_is_refused(folder: Path, spoil: Callable[[Path], object], said: str) -> None:
    spoil(folder)
    with pytest.raises(InputError, match=said) as raised:
        Case.read(folder)
    assert "\n" not in str(raised.value)


def test_bytes_that_are_no_text_are_refused(folder: Path) -> None:
    (folder / "case.json").write_bytes(b"\xff\xfe{")
    with pytest.raises(InputError, match="not JSON"):
        Case.read(folder)


def test_an_endless_file_is_refused(folder: Path) -> None:
    (folder / "case.json").unlink()
    (folder / "case.json").symlink_to("/dev/zero")
    with pytest.raises(InputError, match="not a regular file"):
        Case.read(folder)
