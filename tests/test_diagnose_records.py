"""bayes-hw diagnose RECORD... --holdout RECORD: no model is needed, and one of the same records is opened."""

from __future__ import annotations

import csv
import hashlib
import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from command_files import write_axis, write_record
from simulated_records import measured

from bayes_hw.cli import main
from bayes_hw.commands.diagnose import after_records
from bayes_hw.files import write_csv
from bayes_hw.gap.effects.labels import LABEL_BLOCKS
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


def _column(path: Path, name: str) -> list[float]:
    with path.open() as file:
        return [float(row[name]) for row in csv.DictReader(file)]


@pytest.fixture
def folder(small_axis: HammersteinWiener, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two records with a ramp on the reading and one held out."""
    write_axis(tmp_path, small_axis)
    for seed, name in enumerate(("train_1", "train_2", "holdout"), start=1):
        record = measured(small_axis, 300, seed=seed)
        drifting = Record(
            record.name, record.t, record.u, record.y + 0.004 * record.t, record.sample_rate_hz, record.units
        )
        write_record(tmp_path / f"{name}.csv", drifting)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("folder", "undrawn")
def test_records_alone_give_every_file(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The drift is named, the prediction carries y and the angle of the axis, to which the corrected model
    adds the drift when it is simulated; it predicts. Of an effect of another package it is said that it was
    not tried."""
    known = [*LABEL_BLOCKS, "belt_creep"]
    monkeypatch.setattr("bayes_hw.gap.effects.catalogue.known_labels", lambda: known)
    assert (
        main(
            ["diagnose", "train_1.csv", "train_2.csv", "--holdout", "holdout.csv", "--out", "out", "--quiet"]
        )
        == 0
    )
    assert "not here: belt_creep" in capsys.readouterr().err
    verdict = json.loads(Path("out/verdict.json").read_text())
    assert verdict["answer"] == ["sensor_drift"]
    assert set(verdict["probability"]) == {*LABEL_BLOCKS, "none", "other"}
    assert verdict["next_experiment"]
    assert {"saturation.upper", "dead_zone.half_width", "noise.sigma"} <= set(verdict["base"])
    assert Path("out/report.html").is_file() and Path("out/report.pdf").is_file()
    prediction = Path("out/holdout_prediction.csv")
    np.testing.assert_allclose(_column(prediction, "y"), _column(Path("holdout.csv"), "y"))
    write_csv(
        Path("plain.csv"), {name: np.array(_column(Path("holdout.csv"), name)) for name in ("t", "u", "y")}
    )
    simulate = ["simulate", "plain.csv", "--model", "out/corrected.json", "--out", "run.csv", "--quiet"]
    assert main(simulate) == 0
    drift = np.array(_column(Path("run.csv"), "y_model")) - _column(prediction, "after")
    np.testing.assert_allclose(np.diff(drift), drift[1], atol=1e-9)
    assert drift[1] > 0
    capsys.readouterr()
    assert main(["predict", "plain.csv", "--posterior", "out", "--out", "bands.csv", "--quiet"]) == 0
    low, y, high = (np.array(_column(Path("bands.csv"), name)) for name in ("lo", "y", "hi"))
    inside = float(np.mean((low <= y) & (y <= high)))
    assert inside > 0.8
    assert f"bands hold {100 * inside:.1f} %" in capsys.readouterr().out
    shutil.copyfile("out/corrected.json", "axis.json")
    assert main(["predict", "plain.csv", "--posterior", "axis.json", "--out", "same.csv", "--quiet"]) == 0
    assert Path("same.csv").read_bytes() == Path("bands.csv").read_bytes()


@pytest.mark.slow
@pytest.mark.usefixtures("folder", "undrawn")
def test_a_model_of_the_same_records_is_opened_again(small_axis: HammersteinWiener) -> None:
    for seed, name in enumerate(("train_1", "train_2", "holdout"), start=1):
        write_record(Path(f"{name}.csv"), measured(small_axis, 240, seed=seed))
    content = json.loads(Path("model/model.json").read_text())
    digest = hashlib.sha256(Path("train_1.csv").read_bytes()).hexdigest()
    content["records"] = [{"name": "train_1", "sha256": digest}]
    Path("own.json").write_text(json.dumps(content))
    files = ["--train", "train_1.csv", "--holdout", "holdout.csv", "--no-report", "--quiet"]
    assert main(["diagnose", "--model", "own.json", *files, "--out", "own"]) == 0
    notes = json.loads(Path("own/verdict.json").read_text())["notes"]
    assert any("identified from these very records" in note for note in notes)


class _AskedError(Exception):
    """What would be diagnosed."""


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("given", "train", "lead"), [(("train_1", "train_2", "holdout"), 2, 0), (("train_1",), 1, 200)]
)
def test_where_nothing_is_held_out_a_part_of_the_records_is(
    given: tuple[str, ...],
    train: int,
    lead: int,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def asked(records: Sequence[Record], holdout: Sequence[Record], *_: object, **options: object) -> None:
        raise _AskedError(
            len(records), [record.name for record in holdout], options["lead"], options["notes"]
        )

    monkeypatch.setattr("bayes_hw.gap.joint.joint_diagnosis.diagnose_records", asked)
    with pytest.raises(_AskedError) as caught:
        main(["diagnose", *(f"{name}.csv" for name in given), "--out", "out"])
    said = capsys.readouterr().out
    assert "no record was held out" in said
    assert caught.value.args[:3] == (train, [given[-1]], lead)
    assert caught.value.args[3][0] in said


def test_what_stays_unexplained_asks_for_an_experiment(tmp_path: Path) -> None:
    u = np.array([0.0, -0.75, 0.5, 0.0])
    train = [Record.from_arrays(u=u, y=u, sample_rate_hz=20.0)]
    assert after_records(tmp_path, ("friction",), train)[0] == "design"
    asked = after_records(tmp_path, ("friction", "other"), train)
    assert asked[0] == "design-experiment" and asked[asked.index("--velocity") + 1] == "0.75"
