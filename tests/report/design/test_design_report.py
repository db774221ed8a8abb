"""The report for a controller designer says what holds and what does not, and shows names as text."""

from __future__ import annotations

from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from short_tuning import tune_shortly
from spread_axis import spread_posterior
from strokes import draw_strokes

from bayes_hw.control.axis_draws import AxisDraws
from bayes_hw.control.controller import Controller
from bayes_hw.control.design import Design, DesignSettings, design
from bayes_hw.control.loop import Loop
from bayes_hw.control.margins import Requirements, loop_margins
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.provenance import Provenance, provenance
from bayes_hw.record import Units
from bayes_hw.report.design.design_axis_sections import crossover_section
from bayes_hw.report.design.design_report import design_report
from bayes_hw.report.page.document import Figure, Paragraph, Report, Table
from bayes_hw.report.page.render import to_html, to_pdf
from bayes_hw.report.page.typography import visible

pytestmark = pytest.mark.slow

HOSTILE = '<script>alert(1)</script> #eval("1") $x$ \\ @a \x1b[31m\u202e'


@pytest.fixture(scope="module")
def found(small_axis: HammersteinWiener) -> Design:
    """A controller that keeps its margins, and one that oscillates on about half of the draws."""
    axis = replace(small_axis, name=HOSTILE, units=Units("s", "<u>#", "<y>$"))
    posterior = spread_posterior(axis)
    settings = DesignSettings(100, 40, 30, requirements=Requirements(6.0, 45.0, 0.05))
    calm = Controller(HOSTILE, 20.0, 1.0, 0.2, low_pass_hz=3.0)
    draws = AxisDraws.of_posterior(posterior, posterior.draws(100, np.random.default_rng(1)))
    edge = 10 ** (float(np.median(loop_margins(Loop(draws, calm)).gain_margin_db)) / 20)
    hot = Controller("hot", 20.0, edge, 0.2 * edge, low_pass_hz=3.0)
    with pytest.MonkeyPatch.context() as patch:
        tune_shortly(patch)
        return design(posterior, [calm, hot], np.random.default_rng(1), settings=settings)


@pytest.fixture(scope="module")
def origin() -> Provenance:
    return provenance(f"bayes-hw design {HOSTILE}", 1, [], 2.0)


@pytest.fixture(scope="module")
def report(found: Design, origin: Provenance) -> Report:
    with pytest.MonkeyPatch.context() as patch:
        draw_strokes(patch)
        return design_report(found, origin)


def tables(report: Report) -> list[Table]:
    return [block for section in report.sections for block in section.blocks if isinstance(block, Table)]


def figures(report: Report) -> list[Figure]:
    inner = [block for section in report.sections for block in section.blocks if isinstance(block, Figure)]
    return [report.key_figure, *inner]


def test_the_first_page_answers_in_words(report: Report) -> None:
    """Who keeps the margins and who does not; the numbers are in a table."""
    asked = "a gain margin of 6 dB, phase margin of 45 deg and delay margin of 0.05 s for at least 95"
    assert f" {asked}" in report.verdict
    before, after = report.verdict.split("; ", 1)
    assert before.startswith(HOSTILE) and "hot" not in before
    assert after.startswith("hot ")
    assert "Settings tuned on the point estimate alone break them for" in report.verdict
    assert len(report.verdict.split(". ")) <= 3
    states = {badge.detail.split(";")[0]: badge.state for badge in report.badges}
    assert states["hot"] == "bad" and states[HOSTILE.split(";")[0]] == "good"


def test_the_numbers_of_every_controller_are_in_the_first_table(report: Report, found: Design) -> None:
    first = report.sections[0].blocks[0]
    assert isinstance(first, Table)
    assert [row[0] for row in first.rows] == [loop.controller.name for loop in found.loops]
    hot = found.loops[1]
    assert 0.3 < hot.probability_stable < 0.7
    assert first.rows[0][1].startswith("100.0")
    assert first.rows[1][2].startswith(f"{100 * hot.probability_stable:.1f}")
    assert float(first.rows[1][3].split("\u00a0")[0]) > 0
    assert first.rows[1][4].startswith("0")
    assert first.rows[0][4].endswith("Hz")


def test_held_roots_are_warned_of(report: Report) -> None:
    assert [badge.state for badge in report.badges if badge.label == "other roots of G held"] == ["warn"]


@pytest.mark.usefixtures("undrawn")
def test_an_unconverged_posterior_comes_first(found: Design, origin: Provenance) -> None:
    posterior = replace(found.posterior, converged=False, problems=("R-hat is 1.5",))
    doubtful = design_report(replace(found, posterior=posterior, loops=found.loops[:1], tunings=()), origin)
    assert doubtful.verdict.startswith("The posterior has NOT converged")
    assert doubtful.badges[0].state == "bad"


def test_every_part_has_its_table_and_figure(report: Report) -> None:
    titles = [section.title for section in report.sections]
    for title in ("The axis", "Margins", "Limit cycles", "Tracking", "Uncertainty sets", "Tuning"):
        assert title in titles
    assert len(figures(report)) >= 8
    for figure in figures(report):
        assert len(figure.caption) > 80 and figure.alt_text and "{" not in figure.caption
    for table in tables(report):
        assert table.rows and "{" not in table.caption


def test_numbers_are_those_of_the_design(report: Report, found: Design) -> None:
    (margins,) = [table for table in tables(report) if "gain margin (dB)" in table.header]
    assert len(margins.rows) == len(found.loops)
    median = float(np.median(loop_margins(found.loops[0].loop).gain_margin_db))
    shown = float(margins.rows[0][1].split(" ")[0].split("\u00a0")[0])
    assert shown == pytest.approx(median, abs=0.2)


def test_names_and_units_are_text_in_both_forms(report: Report) -> None:
    page = to_html(report)
    assert "<script>alert" not in page
    assert visible(HOSTILE) in unescape(page)
    assert to_pdf(report).startswith(b"%PDF")


def test_no_curve_is_drawn_where_no_draw_crosses_over(found: Design) -> None:
    """Draws that do not cross over under any gain leave nothing on a logarithmic axis."""
    curves = tuple(
        replace(curve, crossover_hz=np.full_like(curve.crossover_hz, np.nan), allowed_hz=np.nan)
        for curve in found.crossovers
    )
    assert any(isinstance(block, Figure) for block in crossover_section(found).blocks)
    section = crossover_section(replace(found, crossovers=curves))
    assert not any(isinstance(block, Figure) for block in section.blocks)
    assert isinstance(section.blocks[0], Paragraph) and "No proportional gain" in section.blocks[0].text
