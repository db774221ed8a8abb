"""The studies that rest on blind checks run in their quick form with a diagnosis that stands in."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

STUDIES = Path(__file__).resolve().parents[3] / "studies"


@pytest.mark.parametrize(
    ("name", "key"), [("08_blind_check", "easy"), ("09_power", "by_effect"), ("10_leave_one_out", "entries")]
)
def test_quick_run(name: str, key: str, tmp_path: Path) -> None:
    """Results and both reports are written, and the working folder is gone."""
    arguments = ["--quick", "--quiet", "--jobs", "1", "--out", str(tmp_path)]
    done = subprocess.run(
        [sys.executable, STUDIES / f"{name}.py", *arguments, "--diagnosis", "stand_in:always_nothing"],
        capture_output=True,
        text=True,
        timeout=280,
        env=os.environ
        | {
            "PYTHONPATH": os.pathsep.join(sys.path),
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        },
    )
    assert done.returncode == 0, done.stderr[-2000:]
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["study"] == name
    assert results[key]
    assert {path.name for path in tmp_path.iterdir()} == {"results.json", "report.html", "report.pdf"}
