"""A study that is done is skipped when asked to be, until its code, options or files change."""

from __future__ import annotations

import os
import runpy
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from manifest import STUDIES, read_manifest
from study import plainly_named

from bayes_hw.record import Record, Units

SCRIPT = """
\"\"\"Does a study that has nothing to do leave a manifest?\"\"\"
import sys
sys.path.insert(0, {studies!r})
from study import start_study
from bayes_hw.report.page.document import Figure, Report
svg = '<svg xmlns="http://www.w3.org/2000/svg" width="9" height="9"/>'
study = start_study("99_nothing", __doc__)
study.write_results({{"found": 1}})
study.write_document(Report("title", "", "verdict", (), Figure(svg, "caption", "alt"), ()))
"""


@pytest.fixture
def script(tmp_path: Path) -> Path:
    path = tmp_path / "99_nothing.py"
    path.write_text(SCRIPT.format(studies=str(STUDIES)).lstrip())
    return path


@pytest.fixture
def run(
    script: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """Runs the script with more options, and gives what it prints."""

    def printed(*more: str) -> str:
        arguments = ["--out", str(script.parent / "out"), "--unless-done", *more]
        monkeypatch.setattr(sys, "argv", [str(script), *arguments])
        try:
            runpy.run_path(str(script), run_name="__main__")
        except SystemExit as ended:
            assert not ended.code
        return capsys.readouterr().out

    return printed


def test_done_run_is_skipped_until_its_options_change(script: Path, run: Callable[..., str]) -> None:
    out = script.parent / "out"
    out.mkdir()
    (out / "of_an_earlier_run.json").write_text("{}")
    os.utime(out / "of_an_earlier_run.json", (0, 0))
    assert run().startswith("report: ")
    manifest = read_manifest(out)
    assert manifest is not None
    assert manifest.question == "Does a study that has nothing to do leave a manifest?"
    assert set(manifest.files) == {"report.html", "report.pdf", "results.json"}
    stamp = (out / "report.html").stat().st_mtime_ns
    assert run().startswith("done: ")
    assert (out / "report.html").stat().st_mtime_ns == stamp
    assert run("--seed", "2").startswith("report: ")


def test_sources_are_named_from_the_folder_that_differs(tmp_path: Path) -> None:
    t = np.arange(40.0)
    inside = Record(
        "train_1", t, t, t, 1.0, Units("s", "deg/s", "deg"), str(tmp_path / "case" / "train_1.csv")
    )
    assert plainly_named(inside, tmp_path).source == "case/train_1.csv"
    elsewhere = Record("train_1", t, t, t, 1.0, inside.units, "simulated by the twin")
    assert plainly_named(elsewhere, tmp_path) == elsewhere


@pytest.mark.parametrize("study", ["03_rubin_azimuth", "04_emps", "14_first_hour"])
def test_committed_provenance_names_no_folder_of_one_machine(study: str) -> None:
    page = (STUDIES.parent / "reports" / study / "report.html").read_text(encoding="utf-8")
    assert "/tmp/" not in page and "/work/" not in page
