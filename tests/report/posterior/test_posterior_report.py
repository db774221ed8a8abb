"""The report on one axis says first what is wrong, and shows what users name as text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from page_checks import check_page
from short_sampling import sample_shortly
from simulated_records import measured
from strokes import draw_strokes

from bayes_hw.analysis import Analysis, analyse
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.provenance import provenance
from bayes_hw.record import Units
from bayes_hw.report.page.document import Report
from bayes_hw.report.page.render import render
from bayes_hw.report.page.typography import visible
from bayes_hw.report.posterior.posterior_report import posterior_report

pytestmark = pytest.mark.slow

HOSTILE = '<script>alert(1)</script> #eval("1") $x$ *b* {{ 7*7 }} \\ @a \x1b[31m\u202e'
"""Markup of HTML, Typst and Jinja, a terminal's escape and a change of direction."""


@pytest.fixture(scope="module", autouse=True)
def _short_pilot() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        sample_shortly(patch)
        draw_strokes(patch)
        patch.setattr("bayes_hw.infer.convergence.ESS_LIMIT", 1e5)
        yield


@pytest.fixture(scope="module")
def analysis(small_axis: HammersteinWiener) -> Analysis:
    """Far too short a run on records, and in units, with hostile names."""
    units = Units("s", "<u>#", "<y>$")
    record = replace(measured(small_axis, 300, seed=1), name=HOSTILE, source=HOSTILE, units=units)
    held_out = replace(record, name=HOSTILE + "2", treatment=(HOSTILE,))
    return analyse(
        HOSTILE,
        [record],
        [held_out],
        np.random.default_rng(1),
        model=replace(small_axis, name=HOSTILE, units=units),
        settings=SamplerSettings(walkers=16, max_steps=25),
        free="conditional",
    )


@pytest.fixture(scope="module")
def report(analysis: Analysis) -> Report:
    origin = provenance(f"bayes-hw report {HOSTILE}", 1, analysis.records, 2.0)
    return posterior_report(analysis, origin)


def test_a_run_that_has_not_converged_says_so_first(report: Report, analysis: Analysis) -> None:
    assert report.verdict.startswith("The sampler has NOT converged")
    assert analysis.inference.posterior.problems[0] in report.verdict
    card = next(badge for badge in report.badges if badge.label == "not converged")
    assert card.state == "bad"
    assert card.detail.endswith(analysis.inference.posterior.problems[0])


def test_names_are_text_in_both_forms(report: Report, tmp_path: Path) -> None:
    """The page holds the hostile name as it reads, as no tag; Typst sets it without a fault."""
    written = render(report, tmp_path)
    page = written.html.read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "\x1b" not in page and "\u202e" not in page
    assert visible(HOSTILE) in unescape(page)
    assert written.pdf.read_bytes().startswith(b"%PDF")


def test_sections_begin_with_the_evidence_and_end_with_where_the_result_comes_from(report: Report) -> None:
    titles = [section.title for section in report.sections]
    assert titles[:2] == ["Prediction", "The axis"] and titles[-1] == "Provenance"
    assert {"Data", "Convergence"} <= set(titles)


@pytest.mark.parametrize("dark", [False, True])
def test_page_in_a_browser(report: Report, browser: Browser, tmp_path: Path, dark: bool) -> None:
    page = render(report, tmp_path).html
    browser.open(page, dark=dark)
    check_page(browser)
    assert browser.evaluate("document.title") == visible(report.title)
    assert browser.evaluate("document.querySelectorAll('.live canvas').length") == 1
