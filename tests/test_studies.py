"""Every study script runs in its quick form and writes results.json; skipped where its data is absent."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path

import pytest
from manifest import is_kept
from strokes import draw_strokes

STUDIES = Path(__file__).resolve().parents[1] / "studies"
ELSEWHERE = {
    "08_blind_check.py",
    "09_power.py",
    "10_leave_one_out.py",
    "20_unseen_faults.py",
}
"""Studies whose runs are tested beside the modules that they rest on."""

SLOW = {
    "02_twin.py",
    "03_rubin_azimuth.py",
    "04_emps.py",
    "05_calibration.py",
    "06_performance.py",
    "07_practice_cases.py",
    "11_gain_identifiability.py",
    "12_next_experiment.py",
    "13_controller_margins.py",
    "14_first_hour.py",
    "15_real_axes_gap.py",
    "16_error_sources.py",
    "17_interval_width.py",
    "18_two_axes.py",
    "19_decision_constants.py",
    "21_mujoco_sysid.py",
}
"""Studies whose quick form takes more than a few seconds."""

SCRIPTS = [
    pytest.param(path, id=path.stem, marks=[pytest.mark.slow] if path.name in SLOW else [])
    for path in sorted(STUDIES.glob("[0-9][0-9]_*.py"))
    if path.name not in ELSEWHERE
]


@pytest.mark.parametrize("script", SCRIPTS)
def test_quick_run(
    script: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Figures of the quick ones are strokes: tests of their pages draw them."""
    if script.name not in SLOW:
        draw_strokes(monkeypatch)
    arguments = ["--quick", "--quiet", "--jobs", "1", "--out", str(tmp_path)]
    monkeypatch.setattr(sys, "argv", [str(script), *arguments])
    try:
        runpy.run_path(str(script), run_name="__main__")
    except SystemExit as ended:
        said = capsys.readouterr().out
        assert not ended.code and said.startswith("skipped: ")
        pytest.skip(said.strip())
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["study"] == script.stem
    assert results["quick"] is True
    manifest = json.loads((tmp_path / "manifest.json").read_text())
    assert (manifest["study"], manifest["quick"], manifest["seed"]) == (script.stem, True, 1)
    kept = {path.name for path in tmp_path.iterdir() if is_kept(path.name)}
    assert set(manifest["files"]) == kept - {"manifest.json"}
    assert {"results.json", "report.html", "report.pdf"} <= set(manifest["files"])
