"""bayes-hw design from a posterior's folder to its files, and what it refuses in one line."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from command_files import files_below
from short_tuning import tune_shortly
from spread_axis import spread_posterior
from tried_here import try_here

from bayes_hw.cli import main
from bayes_hw.control.controller import Controller
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

QUICK = ("--draws", "100", "--quiet")


@pytest.fixture(autouse=True)
def _short_search(monkeypatch: pytest.MonkeyPatch) -> None:
    tune_shortly(monkeypatch)
    try_here(monkeypatch)


@pytest.fixture(scope="module")
def folder(small_axis: HammersteinWiener, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A posterior made by hand and two controllers."""
    folder = tmp_path_factory.mktemp("posterior")
    posterior = spread_posterior(small_axis)
    posterior.write(folder / "posterior")
    replace(posterior, converged=False, problems=("R-hat of gain is 1.5",)).write(folder / "unconverged")
    Controller("given <b>", 20.0, 1.0, 0.2, low_pass_hz=3.0).write(folder / "pi.json", "deg/s", "deg")
    Controller("fast", 50.0, 1.0).write(folder / "fast.json", "deg/s", "deg")
    return folder


@pytest.mark.usefixtures("undrawn")
def test_writes_everything(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["design", "--posterior", str(folder / "posterior"), "--controller", str(folder / "pi.json")]
    assert main([*arguments, "--out", str(tmp_path), "--draws", "100"]) == 0
    assert files_below(tmp_path) == {
        "design.json", "design.mat", "controller_pi_tuned.json", "report.html", "report.pdf",
    }  # fmt: skip
    content = json.loads((tmp_path / "design.json").read_text())
    assert content["draws"]["count"] == 100
    assert content["requirements"]["delay_margin_s"] == 0.05
    printed = capsys.readouterr()
    assert "given <b>: stable with probability 1.000" in printed.out
    assert "PI tuned over the posterior" in printed.out
    page = (tmp_path / "report.html").read_text()
    assert "given <b>" not in page and "given &lt;b&gt;" in page


@pytest.mark.slow
def test_same_seed_same_file_and_an_unconverged_posterior_is_warned_of(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["design", "--posterior", str(folder / "unconverged"), "--controller", str(folder / "pi.json")]
    for name in ("one", "two"):
        assert main([*given, "--tune", "--no-report", "--out", str(tmp_path / name), *QUICK]) == 0
        assert "has not converged: R-hat of gain is 1.5" in capsys.readouterr().err
    assert files_below(tmp_path / "one") == {"design.json", "design.mat"}
    one, two = ((tmp_path / name / "design.json").read_bytes() for name in ("one", "two"))
    assert one == two


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--share", "1"], "--share 1: must be at least 0.5 and below 1"),
        (["--draws", "10"], "--draws 10: must be 100 or more"),
        (["--phase-margin", "-1"], "--phase-margin -1"),
        (["--tune"], "nothing to tune"),
        (["--controller", "FOLDER/fast.json"], "does not divide"),
        (["--controller", "FOLDER/none.json"], "none.json: cannot be read"),
        (["--posterior", "FOLDER"], "give the --out folder of `bayes-hw sample`"),
    ],
)
def test_refusals_are_one_line_and_write_nothing(
    folder: Path, more: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    given = [word.replace("FOLDER", str(folder)) for word in more]
    arguments = [
        "design",
        "--posterior",
        str(folder / "posterior"),
        "--out",
        str(tmp_path / "out"),
        "--quiet",
    ]
    assert main([*arguments, *given]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert message in line
    assert not (tmp_path / "out").exists()
