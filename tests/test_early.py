"""What is wrong with files is said before anything that computes is imported, which takes seconds."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np

PROGRAM = """
import json, sys
from bayes_hw.cli import main
for arguments in json.load(sys.stdin):
    assert main(arguments) == 2, arguments
slow = {"numba", "scipy", "matplotlib", "dask"}
print(json.dumps(sorted({name.split(".")[0] for name in sys.modules} & slow)))
"""


def log(path: Path, step_s: float, seed: int, *, swapped: bool = False, header: str = "t,u,y") -> None:
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.normal(0, 1, 60), 20)
    y = np.concatenate([[0.0], np.cumsum(u[:-1]) * 0.05]) + 1e-3 * rng.standard_normal(len(u))
    columns = (y, u) if swapped else (u, y)
    np.savetxt(path, np.column_stack([step_s * np.arange(len(u)), *columns]), "%.9g", ",", comments="",
               header=header)  # fmt: skip


def test_nothing_that_computes_is_imported_for_a_refusal(tmp_path: Path) -> None:
    """Missing files, swapped columns, a rate wrong by ten, a record twice, as its own hold-out, in a case."""
    log(tmp_path / "a.csv", 0.05, 1)
    log(tmp_path / "again.csv", 0.05, 1)
    log(tmp_path / "b.csv", 0.05, 2)
    log(tmp_path / "swapped.csv", 0.05, 3, swapped=True)
    log(tmp_path / "slow.csv", 0.5, 4)
    log(tmp_path / "arcsec.csv", 0.05, 5, swapped=True, header="t,u [arcsec/s],y [arcsec]")
    case = tmp_path / "case"
    case.mkdir()
    (case / "case.json").write_text('{"model": "m.json", "train": "a.csv", "holdout": []}')
    a, again, b, swapped, slow, arcsec = (
        str(tmp_path / f"{name}.csv") for name in ("a", "again", "b", "swapped", "slow", "arcsec")
    )
    out = ["--out", str(tmp_path / "out")]
    mistakes = [
        ["identify", str(tmp_path / "absent.csv")],
        ["identify", swapped],
        ["look", slow],
        ["look", arcsec, "--input-unit", "deg/s", "--output-unit", "deg"],
        ["report", a, again],
        ["identify", a, "--holdout", again],
        ["diagnose", a, b, "--holdout", again],
        ["diagnose", str(case)],
        ["diagnose", str(tmp_path)],
        ["sample", "--model", str(tmp_path / "absent.json"), a],
        ["predict", "--posterior", str(tmp_path), a],
        ["design", "--posterior", str(tmp_path)],
        ["design", "--posterior", a],
    ]
    (case / "verdict.json").write_text('{"schema": "bayes-hw/verdict/1", "answer": "friction"}')
    no_files = [["validate", str(tmp_path / "absent.json")], ["validate", str(case / "verdict.json")]]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=json.dumps([*([*each, *out] for each in mistakes), *no_files]),
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(done.stdout) == []
    assert len(done.stderr.splitlines()) == len(mistakes) + len(no_files)
