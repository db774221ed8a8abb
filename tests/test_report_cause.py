"""bayes-hw report ends with the cause where the plain model does not hold, and what follows takes it."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command_files import few_orders, write_axis, write_record
from short_tuning import tune_shortly
from simulated_records import measured
from strokes import draw_strokes

from bayes_hw.cli import main
from bayes_hw.control.controller import Controller
from bayes_hw.errors import InputError
from bayes_hw.model.hammerstein_wiener import HammersteinWiener


def column(path: Path, name: str) -> np.ndarray:
    with path.open() as file:
        return np.array([float(row[name]) for row in csv.DictReader(file)])


@pytest.fixture(scope="module")
def reported(small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder where `report` met records whose reading drifts, none held out, and an older posterior lay."""
    folder = write_axis(tmp_path_factory.mktemp("drift"), small_axis)
    for seed, name in enumerate(("train_1", "train_2", "holdout"), start=1):
        record = measured(small_axis, 300, seed=seed)
        y = record.y + 0.004 * record.t
        write_record(folder / f"{name}.csv", replace(record, y=y))
    (folder / "azimuth").mkdir()
    (folder / "azimuth" / "posterior.nc").write_bytes(b"of the run before")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        draw_strokes(patch)
        few_orders(patch)
        assert main(["report", "train_1.csv", "train_2.csv", "holdout.csv", "--out", "azimuth"]) == 0
    return folder


def read(folder: Path, name: str) -> Any:
    return json.loads((folder / name).read_text())


def test_the_cause_is_named_and_the_refuted_numbers_stand_apart(reported: Path) -> None:
    """The verdict, bands of what was held out, numbers with the effect; the model that does not hold lies in
    a folder of that name, and no posterior of it is left."""
    out = reported / "azimuth"
    assert read(out, "verdict.json")["answer"] == ["sensor_drift"]
    assert any("the last, holdout," in note for note in read(out, "verdict.json")["notes"])
    posterior = read(out, "posterior.json")
    assert posterior["effects"] == ["sensor_drift"]
    assert all(0.98 < one["r_hat"] < 1.2 for one in posterior["parameters"].values())
    assert posterior["parameters"]["saturation.upper"]["mean"] == pytest.approx(1.0, rel=0.05)
    assert posterior["parameters"]["sensor_drift.rate"]["mean"] == pytest.approx(0.004, rel=0.1)
    assert not (out / "posterior.nc").exists()
    assert read(out, "model.json") == read(out, "corrected.json")
    assert (out / "refuted" / "model.json").is_file()
    inside = (column(out / "bands_holdout.csv", "lo") < column(out / "bands_holdout.csv", "y")).mean()
    assert inside > 0.8


def test_the_page_begins_with_what_is_missing(reported: Path) -> None:
    page = (reported / "azimuth" / "report.html").read_text()
    first = page[page.index('class="verdict"') :][:600]
    assert "sensor drift" in first and "sure" in first
    for private in ("block drive", "reducible error", "tempered", "surprise (nats)", "nested R"):
        assert private not in page
    assert page.index('id="figure-1"') < page.index('<section id="section-1"')
    assert "Numbers of a model that does not hold" in page
    assert page.count('<ul class="badges">') == 1
    assert page.split('<ul class="badges">')[1].split("</ul>")[0].count("<li") <= 4


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_a_design_holds_the_effect_and_says_so_first(
    reported: Path, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tune_shortly(monkeypatch)
    out, given = tmp_path / "design", tmp_path / "pi.json"
    Controller("given", 20.0, 1.0, 0.2, low_pass_hz=3.0).write(given, "deg/s", "deg")
    arguments = ["--posterior", str(reported / "azimuth"), "--controller", str(given), "--tune"]
    arguments += ["--draws", "100", "--out", str(out)]
    assert main(["design", *arguments]) == 0
    assert "stable with probability" in capsys.readouterr().out
    page = (out / "report.html").read_text()
    cards = page.split('<ul class="badges">')[1].split("</ul>")[0]
    assert "sensor drift" in cards.split("<li")[1]
    assert read(out, "design.json")["draws"]["count"] >= 100


@pytest.mark.slow
def test_the_experiment_that_confirms_is_played_within_the_limits(reported: Path, tmp_path: Path) -> None:
    out = tmp_path / "next"
    assert main(["design-experiment", "--posterior", str(reported / "azimuth"), "--out", str(out)]) == 0
    command = column(out / "command.csv", "u")
    records = [column(reported / f"{name}.csv", "u") for name in ("train_1", "train_2")]
    assert 0 < np.abs(command).max() <= max(np.abs(u).max() for u in records) * (1 + 1e-9)
    content = read(out, "experiment.json")
    assert content["winner"]["family"] == "slow reversals, then rest"
    assert content["winner"]["expected_gain_nats"] > 0


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_the_search_has_the_time_it_is_given(
    reported: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def diagnosed(*_: object, within_s: float, **__: object) -> None:
        raise InputError(f"searched within {within_s:g} s")

    monkeypatch.chdir(reported)
    monkeypatch.setattr("bayes_hw.commands.report_cause.diagnose_records", diagnosed)
    few_orders(monkeypatch)
    assert main(["report", "train_1.csv", "train_2.csv", "--out", "timed", "--within", "17"]) == 2
    assert "searched within 17 s" in capsys.readouterr().err
