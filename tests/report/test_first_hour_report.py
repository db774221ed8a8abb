"""The truth is opened at the end, beside what was said; an interval that misses it is a miss."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

from pages.first_hour_report import RecordsAlone, Truth, first_hour_report

from bayes_hw.gap.answer.verdict import Estimate
from bayes_hw.report.page.document import Callout, Report, Section, Table

ALONE = RecordsAlone(99.1, 97.0, {"mode1.frequency_hz": 2.3})
TRUTH = Truth(
    ("friction",), ("friction: coulomb",), {"mode1.frequency_hz": 2.0, "gain": 1.0, "noise.sigma": 0.1}
)
BASE = {
    "mode1.frequency_hz": Estimate(2.01, 0.01, (1.99, 2.03), "Hz"),
    "gain": Estimate(1.2, 0.05, (1.1, 1.3), ""),
}


def written(report_of: Callable[[str], Report], answer: tuple[str, ...]) -> Report:
    verdict: Any = SimpleNamespace(answer=answer, base=BASE)
    diagnosis = replace(
        report_of("x"), sections=(Section("Where", ()), Section("Which", ()), Section("Provenance", ()))
    )
    return first_hour_report(diagnosis, verdict, ALONE, TRUTH)


def test_the_truth_stands_after_every_finding(report_of: Callable[[str], Report]) -> None:
    report = written(report_of, ("friction",))
    titles = [section.title for section in report.sections]
    assert titles == ["What lies on the table", "Where", "Which", "The truth, opened", "Provenance"]
    before = str(report.sections[:-2]) + report.title + report.subtitle
    assert "friction" not in before and "2.3" in before
    callout, table = report.sections[-2].blocks
    assert isinstance(callout, Callout) and callout.state == "good" and "coulomb" in callout.text
    assert isinstance(table, Table) and "1 of 2 intervals" in table.caption
    rows = {row[0]: row for row in table.rows}
    assert len(rows) == 2
    mode = rows["frequency of mode 1"]
    gain = rows["gain of G"]
    assert mode[2] == "2.300" and mode[-1] == "yes"
    assert gain[2] == "" and gain[-1] == "NO"


def test_a_wrong_answer_is_said_to_be_wrong(report_of: Callable[[str], Report]) -> None:
    callout = written(report_of, ()).sections[-2].blocks[0]
    assert isinstance(callout, Callout) and callout.state == "bad"
    assert callout.text.startswith("The answer was no structural gap")
