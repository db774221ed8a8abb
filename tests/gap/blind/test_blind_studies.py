"""The studies that rest on blind checks run in their quick form with a diagnosis that stands in."""

from __future__ import annotations

import importlib
import json
import runpy
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from serial_executor import SerialExecutor

from bayes_hw.gap.blind.counts import Share
from bayes_hw.plant.kinds import KINDS
from bayes_hw.report.blind.figures_blind import shares
from bayes_hw.report.page.document import Paragraph, Report, Section

STUDIES = Path(__file__).resolve().parents[3] / "studies"


@pytest.mark.parametrize(("name", "key", "diagnosis", "written"), [
    ("08_blind_check", "easy", "always_nothing", set()),
    pytest.param("09_power", "by_effect", "always_nothing", set(), marks=pytest.mark.slow),
    pytest.param("10_leave_one_out", "entries", "always_nothing", set(), marks=pytest.mark.slow),
    pytest.param("20_unseen_faults", "by_fault", "always_nothing", set(), marks=pytest.mark.slow),
    pytest.param(
        "19_decision_constants", "adopted", "nothing_with_ballot", {"calibration.json"},
        marks=pytest.mark.slow,
    ),
])  # fmt: skip
@pytest.mark.usefixtures("undrawn")
def test_quick_run(
    name: str,
    key: str,
    diagnosis: str,
    written: set[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On records of 40 s, where the study leaves the length open: results and both reports are written, and
    the working folder is gone; their figures are drawn in tests of the reports."""
    monkeypatch.syspath_prepend(str(STUDIES))
    for kind in ("easy", "hard"):
        monkeypatch.setitem(KINDS, kind, replace(KINDS[kind], durations_s=(40.0,)))  # type: ignore[arg-type]
    study = importlib.import_module("study")
    monkeypatch.setattr(study, "make_executor", lambda *_: SerialExecutor())
    arguments = ["--quick", "--quiet", "--out", str(tmp_path), "--diagnosis", f"stand_in:{diagnosis}"]
    monkeypatch.setattr(sys, "argv", [f"{name}.py", *arguments])
    runpy.run_path(str(STUDIES / f"{name}.py"), run_name="__main__")
    results = json.loads((tmp_path / "results.json").read_text())
    assert results["study"] == name
    assert results[key]
    assert ("from_records" in results) == (name in ("08_blind_check", "19_decision_constants"))
    assert {path.name for path in tmp_path.iterdir()} == {
        "manifest.json",
        "results.json",
        "report.html",
        "report.pdf",
        *written,
    }


def test_pages_of_unseen_faults_have_the_sections_that_say_something(monkeypatch: pytest.MonkeyPatch) -> None:
    """By fault first, what was named wrong, where it comes from; nothing of chance among single labels."""
    monkeypatch.syspath_prepend(str(STUDIES))
    importlib.import_module("study")
    pages = runpy.run_path(str(STUDIES / "20_unseen_faults.py"))
    titles = ("What was named", "Would the score notice?", pages["NAMED_WRONG"], pages["PROVENANCE"])
    sections = tuple(Section(title, (Paragraph("x"),)) for title in titles)
    figure = shares({"hum": Share(1, 2)}, "Faults")
    whole = Report("Blind check", "subtitle", "verdict.", (), figure, sections)
    report = pages["report_by_fault"](whole, {"hum": Share(1, 2)})
    assert [section.title for section in report.sections] == ["By fault", "Cases named wrong", "Provenance"]
