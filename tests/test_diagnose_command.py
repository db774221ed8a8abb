"""bayes-hw diagnose: bad usage is one line and status 2, a good run writes the fixed files."""

from __future__ import annotations

import csv
import json
import runpy
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from command_files import copied_axis, files_below

from bayes_hw.cli import build_parser, main
from bayes_hw.commands.early import refuse_early
from bayes_hw.errors import InputError
from bayes_hw.files import write_csv
from bayes_hw.gap.case.simulator_case import SimulatorCase, find_simulator
from bayes_hw.gap.effects.labels import LABEL_BLOCKS

FEW = ("--without", *(label for label in LABEL_BLOCKS if label not in ("command_bias", "sensor_drift")))
"""A catalogue of two labels, for speed."""

MODEL = ("--model", "model/model.json")
TRAIN = ("--train", "train_1.csv", "train_2.csv")
HOLDOUT = ("--holdout", "holdout.csv")


@pytest.fixture
def folder(axis_files: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A case folder, the working folder as well."""
    copied_axis(axis_files, tmp_path)
    case = {"model": "model/model.json", "train": list(TRAIN[1:]), "holdout": list(HOLDOUT[1:])}
    (tmp_path / "case.json").write_text(json.dumps(case))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., str]:
    """Runs the command, which must be refused; the line it says."""

    def run(*arguments: str) -> str:
        before = files_below(folder)
        assert main(["diagnose", *arguments, "--out", "new"]) == 2
        printed = capsys.readouterr()
        assert printed.out == ""
        (line,) = printed.err.splitlines()
        assert line.startswith("bayes-hw: error: ") and line.isprintable()
        assert files_below(folder) == before
        return line

    return run


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "either a case folder or --model"),
        ((".", *MODEL), "either a case folder or --model"),
        ((".", *TRAIN), "--train and --holdout go with --model"),
        ((".", "--without", "gremlins"), "--without gremlins: not in the catalogue; use one of rate_limit"),
        (("nowhere",), "case.json: cannot be read"),
        ((*MODEL, "--simulator", "json:loads"), "either a case folder or --model or --simulator"),
        (("--simulator", "json:absent", *TRAIN), "--simulator json:absent: cannot be imported"),
        (("--simulator", "json:__name__", *TRAIN), "returned no simulator"),
        (("--simulator", "json:loads", *TRAIN), "--simulator json:loads: fails (TypeError"),
        ((*MODEL, *TRAIN, "--without", "dead_zone"), "--without dead_zone: not in the catalogue"),
        ((*MODEL, *TRAIN), "no record held out"),
        ((*MODEL, *HOLDOUT), "no record to train on"),
        (("--model", "no.json", *TRAIN, *HOLDOUT), "no.json: cannot be read"),
        ((*MODEL, "--train", "no.csv", *HOLDOUT), "no.csv"),
    ],
)
def test_bad_usage_is_one_line(refused: Callable[..., str], arguments: tuple[str, ...], said: str) -> None:
    assert said in refused(*arguments)


@pytest.mark.parametrize("time", ["0", "-3", "soon", "nan"])
def test_a_time_is_above_zero(time: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["diagnose", ".", f"--within={time}"])
    assert f"{time!r} is no time" in capsys.readouterr().err


def test_an_output_that_is_a_file_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diagnose", str(folder), "--out", "holdout.csv", "--quiet"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "holdout.csv" in line


def verdict(folder: Path, name: str, *arguments: str) -> dict[str, object]:
    given = ["diagnose", *arguments, "--out", name, "--no-report", "--jobs", "1", *FEW]
    assert main(given) == 0
    assert files_below(folder / name) == {"verdict.json", "holdout_prediction.csv", "corrected.json"}
    content: dict[str, object] = json.loads((folder / name / "verdict.json").read_text())
    assert content.pop("seconds") > 0  # type: ignore[operator]
    return content


def test_a_case_folder_or_its_files_give_one_verdict(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """An axis without a gap: it is said that nothing is missing, on stdout too; --quiet says no more."""
    content = verdict(folder, "case_out", ".")
    printed = capsys.readouterr()
    assert printed.out.startswith("Nothing is missing")
    assert len(printed.err.splitlines()) > 3
    assert content["schema"] == "bayes-hw/verdict/1" and content["answer"] == []
    assert set(content["probability"]) == {"none", "other", "command_bias", "sensor_drift"}  # type: ignore[call-overload]
    with (folder / "case_out" / "holdout_prediction.csv").open() as stream:
        header, *rows = csv.reader(stream)
    assert header[:5] == ["t", "before", "after", "lo", "hi"] and len(rows) == 400
    assert verdict(folder, "files_out", *MODEL, *TRAIN, *HOLDOUT, "--quiet") == content
    quiet = capsys.readouterr()
    assert quiet.err == "" and quiet.out.startswith("Nothing is missing")
    assert printed.out.splitlines()[-1].startswith("next: bayes-hw diagnose . --")


@pytest.mark.usefixtures("undrawn")
@pytest.mark.usefixtures("undrawn")
def test_a_report_unless_told_otherwise(folder: Path) -> None:
    pytest.importorskip(
        "bayes_hw.report.diagnosis.diagnosis_report", reason="the report of a diagnosis is not there"
    )
    assert main(["diagnose", ".", "--out", "new", "--jobs", "1", "--quiet", *FEW]) == 0
    found = files_below(folder / "new")
    assert found == {"verdict.json", "holdout_prediction.csv", "corrected.json", "report.html", "report.pdf"}


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_pages_of_results_that_are_gone_do_not_stay(folder: Path) -> None:
    (folder / "again").mkdir()
    (folder / "again" / "report.html").write_text("of the run before")
    verdict(folder, "again", ".")


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
@pytest.mark.usefixtures("undrawn")
def test_a_simulator_of_ones_own_is_diagnosed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """As the tutorial shows it, its module and all: a dead zone of the motor is named."""
    shutil.copy(Path(__file__).parents[1] / "docs" / "tutorials" / "my_motor.py", tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    simulator = find_simulator("my_motor:simulator")
    rng = np.random.default_rng(3)
    for name in ("a", "b", "c"):
        u = np.repeat(rng.uniform(-9, 9, 25), 20)
        moved = np.maximum(u - 2.2, 0) + np.minimum(u + 1.8, 0)
        y = simulator.simulate(np.array([[33.0, 0.27]]), moved)[0] + rng.normal(0, 1, len(u))
        write_csv(tmp_path / f"{name}.csv", {"t": np.arange(len(u)) / 20.0, "u": u, "y": y})
    given = ["--simulator", "my_motor:simulator", "--train", "a.csv", "b.csv", "--holdout", "c.csv"]
    assert main(["diagnose", *given, "--out", "new", "--jobs", "1"]) == 0
    assert "dead_zone" in capsys.readouterr().out
    verdict = json.loads((tmp_path / "new" / "verdict.json").read_text())
    assert verdict["answer"] == ["dead_zone"]
    assert verdict["base"]["speed_per_volt"]["unit"] == "rpm/V"
    report = (tmp_path / "new" / "report.html").read_text(encoding="utf-8")
    assert "no noise level was given" in report and "nan" not in report.lower().split("provenance")[0].split()


def test_records_of_a_simulator_are_in_its_units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of the tutorial: a speed in rpm under volts, which would be no angle were it deg/s and deg."""
    tutorials = Path(__file__).parents[1] / "docs" / "tutorials"
    for name in ("my_motor.py", "make_motor_records.py"):
        shutil.copy(tutorials / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    runpy.run_path("make_motor_records.py")
    records = ["--train", "a.csv", "b.csv", "--holdout", "c.csv", "--out", "new"]
    refuse_early(build_parser().parse_args(["diagnose", "--simulator", "my_motor:simulator", *records]))
    with pytest.raises(InputError, match="the output is a speed"):
        refuse_early(build_parser().parse_args(["identify", "a.csv", "b.csv", "--out", "new"]))
    simulator = find_simulator("my_motor:simulator")
    case = SimulatorCase.of_files(simulator, [Path("a.csv")], [Path("c.csv")])
    assert case.train[0].units == simulator.units and not case.train[0].findings()


@pytest.mark.slow
def test_columns_are_mapped_as_for_other_commands(folder: Path) -> None:
    """The same verdict from records under other names, of a case folder too."""
    expected = verdict(folder, "plain", ".", "--quiet")
    for name in ("train_1", "train_2", "holdout"):
        path = folder / f"{name}.csv"
        path.write_text(path.read_text().replace("t,u,y", "time,cmd,ang", 1))
    mapped = ("--time", "time", "--input", "cmd", "--output", "ang", "--quiet")
    assert verdict(folder, "of_case", ".", *mapped) == expected
    assert verdict(folder, "of_files", *MODEL, *TRAIN, *HOLDOUT, *mapped)["answer"] == expected["answer"]


@pytest.mark.parametrize("name", ["a\0b.csv", "\ud800.csv"])
def test_a_case_with_a_name_that_no_file_has(refused: Callable[..., str], folder: Path, name: str) -> None:
    case = {"model": "model/model.json", "train": [name], "holdout": list(HOLDOUT[1:])}
    (folder / "case.json").write_text(json.dumps(case))
    assert "cannot be read" in refused(".")


@pytest.mark.slow
def test_a_case_needs_no_out(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its results lie beside it under its name, which is said."""
    case = folder / "azimuth"
    case.mkdir()
    content = json.loads((folder / "case.json").read_text())
    moved = {key: [f"../{name}" for name in content[key]] for key in ("train", "holdout")}
    (case / "case.json").write_text(json.dumps({"model": "../model/model.json"} | moved))
    assert main(["diagnose", "azimuth", "--no-report", "--jobs", "1", "--quiet", *FEW]) == 0
    assert (folder / "azimuth_diagnosis" / "verdict.json").exists()
    assert "azimuth_diagnosis/verdict.json" in capsys.readouterr().out
