"""bayes-hw convert: records and models arrive as they were, and nothing bad is half done."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from command_files import files_below, write_axis

import bayes_hw as hw
from bayes_hw.cli import main
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record


@pytest.fixture
def folder(small_axis: HammersteinWiener, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write_axis(tmp_path, small_axis)


@pytest.mark.parametrize("ending", [".mat", ".h5", ".parquet"])
def test_commands_take_a_converted_record(
    folder: Path, ending: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """Simulated from any format, the response is that of the CSV file, to the last digit."""
    assert main(["convert", "train_1.csv", "--out", f"new/train{ending}"]) == 0
    assert f"new/train{ending}: 400 samples at 20 Hz" in capsys.readouterr().out
    for source in ("train_1.csv", f"new/train{ending}"):
        model = ("--model", "model/model.json")
        assert main(["simulate", *model, source, "--out", f"{Path(source).name}.run.csv", "--quiet"]) == 0
    assert (folder / f"train{ending}.run.csv").read_bytes() == (folder / "train_1.csv.run.csv").read_bytes()


def test_a_model_goes_to_matlab_and_back(folder: Path, small_axis: HammersteinWiener) -> None:
    assert main(["convert", "model/model.json", "--out", "m.mat", "--quiet"]) == 0
    assert main(["convert", "m.mat", "--out", "back.json", "--quiet"]) == 0
    u = Record.read("train_1.csv").u
    np.testing.assert_allclose(
        HammersteinWiener.read(folder / "back.json").simulate(u).y, small_axis.simulate(u).y, atol=1e-12
    )
    assert main(["simulate", "--model", "m.mat", "train_1.csv", "--out", "run.csv", "--quiet"]) == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (
            ("train_1.csv", "--out", "train_1.xlsx"),
            "train_1.xlsx: no ending of a record's file; use one of .csv",
        ),
        (
            ("train_1.csv", "--out", "train.json"),
            "train_1.csv: no ending of a model's file; use one of .json, .mat",
        ),
        (("train_1.csv", "--out", "train_1.csv"), "would overwrite an input"),
        (("missing.csv", "--out", "a.mat"), "missing.csv: cannot be read"),
        (("model/model.json", "--out", "a.csv"), "a.csv: no ending of a model's file"),
    ],
)
def test_bad_usage_is_one_line(
    folder: Path, arguments: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before = files_below(folder)
    assert main(["convert", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert files_below(folder) == before


def _log(path: Path, header: str, stamps: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """A unit-gain axis at 100 Hz, with whole stamps or none."""
    u = np.repeat(np.random.default_rng(3).uniform(-0.5, 0.5, 60), 50)
    y = 231.4 + np.concatenate([[0.0], np.cumsum(u)[:-1]]) / 100
    columns = [u, y] if stamps is None else [stamps, u, y]
    rows = [",".join(f"{value:.9g}" for value in row) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([header, *rows]) + "\n")
    return u, y


@pytest.mark.parametrize(
    ("stated", "doubted"), [("250", True), pytest.param("40", True, marks=pytest.mark.slow), ("100", False)]
)
def test_a_stated_rate_that_the_motion_contradicts_is_doubted_on_both_doors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], stated: str, doubted: bool
) -> None:
    path = tmp_path / "log.csv"
    u, y = _log(path, "u,y", None)
    reading = (str(path), "--time", "none", "--sample-rate", stated)
    assert main(["convert", *reading, "--out", str(tmp_path / "out.csv")]) == 0
    said = capsys.readouterr().err
    assert ("rather about" in said) == doubted
    assert "(--sample-rate)" in said or not doubted
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        hw.look(hw.Record.from_arrays(u=u, y=y, sample_rate_hz=float(stated)))
    found = [str(one.message) for one in caught if "rather about" in str(one.message)]
    assert bool(found) == doubted
    assert all("`sample_rate_hz`" in one for one in found)


def test_milliseconds_called_microseconds_are_named_on_both_doors(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "log.csv"
    _log(path, "t,u,y", 10.0 * np.arange(3000) + 1_794_603_847)
    reading = (str(path), "--time-unit", "us")
    assert main(["convert", *reading, "--out", str(tmp_path / "out.csv")]) == 0
    assert "(--time-unit ms)" in capsys.readouterr().err
    assert main(["look", *reading, "--out", str(tmp_path / "look")]) == 2
    assert "(--time-unit ms)" in capsys.readouterr().err
    record = hw.Record.read(path, options=hw.ReadingOptions(time_unit="us"))
    with pytest.raises(hw.InputError, match="counts in ms"):
        hw.look(record)
    hw.look(hw.Record.read(path, options=hw.ReadingOptions(time_unit="ms")))
