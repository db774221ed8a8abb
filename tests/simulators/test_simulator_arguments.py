"""A simulator's file where a model is asked for: on the command line and from Python, and what is refused."""

from __future__ import annotations

import builtins
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from example_axis import commands, record, write_mjcf

import bayes_hw as hw
from bayes_hw.cli import main
from bayes_hw.errors import InputError
from bayes_hw.files import write_csv
from bayes_hw.simulators.simulator_diagnosis import is_simulator_file, open_simulator

U = commands(np.random.default_rng(1), 300)
A, B = (record(name, U, factor * np.cumsum(U) / 50) for name, factor in (("a", 1.0), ("b", 0.9)))


def test_files_are_told_from_functions() -> None:
    assert all(map(is_simulator_file, ("axis.xml", "a/axis.urdf", "axis.FMU")))
    assert not is_simulator_file("module:function")


def test_python_refuses_what_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not there"):
        hw.diagnose(str(tmp_path / "none.xml"), A, B)
    with pytest.raises(InputError, match="declaration"):
        hw.diagnose(A, B, declaration="axis.toml")
    with pytest.raises(InputError, match="holdout"):
        hw.diagnose(write_mjcf(tmp_path), A)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--simulator", "none.fmu"], "none.fmu: is not there"),
        (
            ["--simulator", "os:getcwd", "--declaration", "axis.toml"],
            "--declaration goes with --simulator FILE",
        ),
    ],
)
def test_the_command_line_says_what_to_give(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for each in (A, B):
        write_csv(tmp_path / f"{each.name}.csv", {"t": each.t, "u": each.u, "y": each.y})
    records = ["--train", str(tmp_path / "a.csv"), "--holdout", str(tmp_path / "b.csv")]
    out = [*records, "--out", str(tmp_path / "out")]
    assert main(["diagnose", *arguments, *out]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert said in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(("name", "extra"), [("axis.xml", "mujoco"), ("axis.fmu", "fmu")])
def test_a_missing_extra_is_named(
    name: str, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_mjcf(tmp_path).rename(tmp_path / name)
    real = builtins.__import__

    def without(module: str, *rest: Any, **named: Any) -> Any:
        if module.partition(".")[0] in ("mujoco", "fmpy"):
            raise ImportError(module)
        return real(module, *rest, **named)

    for module in [m for m in sys.modules if m.startswith("bayes_hw.simulators.unit_loop")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(InputError, match=rf"pip install bayes-hw\[{extra}\]"):
        open_simulator(path, tmp_path / "axis.toml")
