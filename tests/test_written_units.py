"""Units on the way through: what is written is in the unit asked for, and the next command reads it."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest
from command_files import write_axis
from drawn_posterior import posterior_of

from bayes_hw.cli import main
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import ReadingOptions, Record

RAD = np.pi / 180


@pytest.fixture
def folder(small_axis: HammersteinWiener, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return write_axis(tmp_path, small_axis)


def _log(path: Path, factor: float, hole: int | None = None) -> Path:
    """A log in deg/s and rad, of an axis of gain one, with jitter of neither clock nor rate."""
    t = np.arange(1200) / 20
    u = 0.5 * np.sin(0.9 * t) + 0.2 * np.sin(4.1 * t)
    y = factor * (np.cumsum(u) / 20 + 1e-3 * np.random.default_rng(1).standard_normal(1200))
    rows = [f"{a:.2f},{b:.6f},{c:.8f}" for k, (a, b, c) in enumerate(zip(t, u, y, strict=True)) if k != hole]
    path.write_text("\n".join(["t [s],u [deg/s],y [rad]", *rows]) + "\n")
    return path


def test_command_after_convert_reads_what_it_wrote(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Units that the header does not hold and samples that were not measured are said again."""
    source = _log(tmp_path / "log.csv", RAD, hole=500)
    out = tmp_path / "record.csv"
    assert main(["convert", str(source), "--gaps", "bridge", "--out", str(out)]) == 0
    following = shlex.split(capsys.readouterr().out.splitlines()[-1].removeprefix("next: bayes-hw "))
    assert following[0] == "report"
    options = following[2:-2]
    assert main(["look", str(out), *options, "--out", str(tmp_path / "look")]) == 0
    (whole,) = Record.read_all(source, ReadingOptions(gaps="bridge"))
    (again,) = Record.read_all(out, ReadingOptions(units={"output": "rad"}, gaps="bridge"))
    assert options == ["--output-unit", "rad", "--gaps", "bridge"]
    assert again.units == whole.units
    np.testing.assert_array_equal(again.measured_samples, whole.measured_samples)


@pytest.mark.parametrize("command", ["inspect", pytest.param("look", marks=pytest.mark.slow)])
def test_degrees_beside_radians_are_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    source = str(_log(tmp_path / "log.csv", RAD))
    out = [] if command == "inspect" else ["--out", str(tmp_path / "out")]
    assert main([command, source, *out]) == 0
    said = capsys.readouterr().out
    assert said.count("--output-unit deg converts the output to deg") == 1
    assert main([command, source, *out, "--output-unit", "deg"]) == 0
    assert "converts the output" not in capsys.readouterr().out


@pytest.mark.usefixtures("folder")
def test_simulation_is_written_in_the_units_asked_for() -> None:
    named = ["simulate", "--model", "model/model.json", "train_1.csv"]
    assert main([*named, "--out", "deg.csv"]) == 0
    record = Record.read("train_1.csv")
    rows = zip(record.t, record.u * RAD, record.y * RAD, strict=True)
    Path("rad.csv").write_text(
        "t [s],u [rad/s],y [rad]\n" + "\n".join(f"{t:.17g},{u:.17g},{y:.17g}" for t, u, y in rows) + "\n"
    )
    named[-1] = "rad.csv"
    units = ["--input-unit", "rad/s", "--output-unit", "rad"]
    assert main([*named, *units, "--out", "asked.csv"]) == 0
    plain, asked = (np.genfromtxt(name, delimiter=",", names=True) for name in ("deg.csv", "asked.csv"))
    for name in ("u", "y", "w", "y_model"):
        np.testing.assert_allclose(asked[name], plain[name] * RAD, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(asked["t"], plain["t"])


@pytest.mark.usefixtures("folder")
def test_prediction_is_written_in_the_units_asked_for(small_axis: HammersteinWiener) -> None:
    posterior_of(small_axis).write(Path("posterior"))
    named = ["predict", "--posterior", "posterior", "train_1.csv"]
    assert main([*named, "--out", "deg.csv"]) == 0
    content = Path("train_1.csv").read_text()
    Path("stated.csv").write_text(content.replace("t,u,y", "t [s],u [deg/s],y [deg]", 1))
    named[-1] = "stated.csv"
    assert main([*named, "--output-unit", "rad", "--out", "asked.csv"]) == 0
    plain, asked = (np.genfromtxt(name, delimiter=",", names=True) for name in ("deg.csv", "asked.csv"))
    np.testing.assert_allclose(asked["u"], plain["u"])
    for name in ("y", "mean", "lo", "hi"):
        np.testing.assert_allclose(asked[name], plain[name] * RAD, rtol=1e-9, atol=1e-12)


def test_simulation_in_a_unit_of_something_else_is_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    named = ["simulate", "--model", "model/model.json", "train_1.csv", "--output-unit", "V"]
    assert main([*named, "--out", "run.csv"]) == 2
    assert "V" in capsys.readouterr().err
    assert not (folder / "run.csv").exists()
