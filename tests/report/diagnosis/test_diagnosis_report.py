"""The report of a diagnosis says the verdict first, tabulates what was tried, and shows names as text."""

from __future__ import annotations

from dataclasses import replace
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from page_checks import check_page
from simulated_records import coloured_noise, command, measured

from bayes_hw.gap.answer.base_average import base_shifts
from bayes_hw.gap.answer.ranking import ranking
from bayes_hw.gap.case.case import Case
from bayes_hw.gap.criticism.residual_map import residual_map
from bayes_hw.gap.diagnosis import Diagnosis, diagnose
from bayes_hw.gap.effects.descriptions import DESCRIPTIONS
from bayes_hw.gap.simulate.builder import Followed
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.provenance import provenance
from bayes_hw.record import Record, Units
from bayes_hw.report.diagnosis.diagnosis_numbers import share_interval
from bayes_hw.report.diagnosis.diagnosis_report import diagnosis_report
from bayes_hw.report.diagnosis.diagnosis_sections import where_section
from bayes_hw.report.page.document import Bullets, Callout, Paragraph, Report, Table, ZoomableRecord
from bayes_hw.report.page.render import render
from bayes_hw.report.page.typography import visible

HOSTILE = '<script>alert(1)</script> #eval("1") $x$ *b* {{ 7*7 }} \\ @a \x1b[31m\u202e'
"""Markup of HTML, Typst and Jinja, a terminal's escape and a change of direction."""

BIAS = 0.15
"""Added to the command after the limiter, in units of the command."""

UNITS = Units("s", "<u>#", "<y>$")


def _biased(axis: HammersteinWiener, samples: int, seed: int) -> Record:
    """A record of `axis` whose limits and command are shifted so that BIAS enters after the limiter."""
    rng = np.random.default_rng(seed)
    u = command(samples, rng)
    limits = axis.saturation
    shifted = replace(limits, lower=limits.lower + BIAS, upper=limits.upper + BIAS)
    y = replace(axis, saturation=shifted).simulate(u + BIAS, 0.0).y
    y = y + coloured_noise(samples, axis.noise_sigma, 0.3, rng)
    return replace(measured(axis, samples, seed), name=f"{HOSTILE}{seed}", u=u, y=y, units=UNITS)


@pytest.fixture(scope="module")
def diagnosis(small_axis: HammersteinWiener) -> Diagnosis:
    axis = replace(small_axis, name=HOSTILE, units=UNITS)
    train = [_biased(axis, 300, 1), _biased(axis, 300, 2)]
    case = Case.of_records(HOSTILE, axis, train, [_biased(axis, 250, 3)])
    return diagnose(case, np.random.default_rng(1))


@pytest.fixture(scope="module")
def report(diagnosis: Diagnosis) -> Report:
    case = diagnosis.case
    return diagnosis_report(
        diagnosis, provenance(f"bayes-hw diagnose {HOSTILE}", 1, [*case.train, *case.holdout], 2.0)
    )


def _tables(report: Report, section: str) -> list[Table]:
    blocks = next(s.blocks for s in report.sections if s.title == section)
    return [block for block in blocks if isinstance(block, Table)]


@pytest.mark.slow
def test_the_verdict_comes_first_in_words(report: Report, diagnosis: Diagnosis) -> None:
    assert diagnosis.verdict.answer == ("command_bias",)
    assert report.verdict.startswith(diagnosis.sentence().replace("+-", "±"))
    assert report.badges[0].label == "command bias"
    assert [s.title for s in report.sections if not s.folded] == [
        "Does it predict what it has not seen?",
        "What is it, and what to do?",
        "Where does it show?",
        "How sure are the numbers?",
    ]
    first = " ".join([report.verdict, *(f"{badge.label} {badge.detail}" for badge in report.badges)])
    assert not {"nats", "surprise", "block", "residual", "evidence"} & set(first.lower().split())
    assert len(report.badges) <= 4


@pytest.mark.slow
def test_it_says_what_the_effect_looks_like_and_what_to_do(report: Report) -> None:
    blocks = next(s.blocks for s in report.sections if s.title == "What is it, and what to do?")
    said = [item for block in blocks if isinstance(block, Bullets) for item in block.items]
    described = DESCRIPTIONS["command_bias"]
    assert f"What it looks like: {described.looks}" in said and f"What to do: {described.remedy}" in said


@pytest.mark.slow
@pytest.mark.parametrize(("regime", "said"), [
    ("all", "it is no larger in any state of motion"), ("slow", "it is largest in the samples “slow”"),
])  # fmt: skip
@pytest.mark.usefixtures("undrawn")
def test_the_regime_is_named_where_one_stands_out(diagnosis: Diagnosis, regime: str, said: str) -> None:
    where = replace(diagnosis.verdict.where, regime=regime)
    first = where_section(replace(diagnosis, verdict=replace(diagnosis.verdict, where=where))).blocks[0]
    assert isinstance(first, Paragraph) and said in first.text


@pytest.mark.slow
def test_the_ranking_marks_the_answer_and_holds_every_set_tried(report: Report, diagnosis: Diagnosis) -> None:
    rows = _tables(report, "What else was weighed?")[0].rows
    assert [row[0] for row in rows if row[0].startswith("▸")] == ["▸ command_bias"]
    ranked = ranking(diagnosis.attribution, diagnosis.verdict.gap_train.noise_floor, diagnosis.left_out)
    base = next(row for row in ranked if not row.labels)
    assert base.gain == 0.0
    assert base.rmse == pytest.approx(diagnosis.attribution.base.fit.rmse)
    best = next(row for row in ranked if row.labels == ("command_bias",))
    assert best.closes == pytest.approx(1.0, abs=0.1)
    assert best.left_out is not None and best.left_out.density == 0 and best.left_out.weight > 0.9
    assert base.left_out is not None and base.left_out.density < -5 * base.left_out.error
    gains = [row.gain for row in ranked if row.gain is not None]
    assert gains == sorted(gains, reverse=True)


@pytest.mark.slow
def test_base_parameters_stand_before_and_after(report: Report, diagnosis: Diagnosis) -> None:
    """The bias had been taken up by the limits, which it pushes by many of their standard deviations."""
    table = _tables(report, "How sure are the numbers?")[-1]
    assert table.header[-1] == "pushed (sd)"
    shifts = {
        shift.name: shift
        for shift in base_shifts(
            diagnosis.attribution.base, diagnosis.case.model.noise_sigma, diagnosis.verdict.base
        )
    }
    assert len(table.rows) == len(shifts) == len(diagnosis.verdict.base)
    lower = shifts["saturation.lower"]
    assert lower.nominal == diagnosis.case.model.saturation.lower
    assert lower.pushed == pytest.approx((lower.alone - lower.joint.mean) / lower.joint.sd)
    assert abs(lower.pushed) > 2


@pytest.mark.slow
def test_the_record_held_out_can_be_zoomed(report: Report, diagnosis: Diagnosis) -> None:
    blocks = next(s.blocks for s in report.sections if s.title == "Does it predict what it has not seen?")
    shown = next(block for block in blocks if isinstance(block, ZoomableRecord))
    assert np.array_equal(shown.mean, diagnosis.after)
    assert np.array_equal(shown.y, diagnosis.case.holdout[0].y)


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_rivals_are_on_the_card_each_once(diagnosis: Diagnosis) -> None:
    pairs = [("command_bias", "gain_drift"), ("command_bias", "wind")]
    verdict = replace(diagnosis.verdict, confusable=pairs)
    shown = diagnosis_report(
        replace(diagnosis, verdict=verdict), provenance("bayes-hw diagnose", 1, diagnosis.case.train, 2.0)
    )
    (card,) = [badge for badge in shown.badges if badge.label == "not told apart"]
    assert card.detail == "could also be gain drift, wind" and len(shown.badges) == 4


def test_no_share_is_all_of_it() -> None:
    assert share_interval(0.126, 0.99999).replace("\u00a0", " ") == "12.6 % to 99.9 %"


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_other_and_none_say_that_nothing_was_added(diagnosis: Diagnosis) -> None:
    """The same fits under the two verdicts that add no effect."""
    origin = provenance("bayes-hw diagnose", 1, diagnosis.case.train, 2.0)
    base = replace(diagnosis.decision, explanation=diagnosis.attribution.base)
    for answer, badge, decision in (
        (("other",), "not explained", diagnosis.decision),
        ((), "nothing is missing", base),
    ):
        verdict = replace(diagnosis.verdict, answer=answer, parameters={}, confusable=[])
        shown = diagnosis_report(replace(diagnosis, verdict=verdict, decision=decision), origin)
        assert shown.badges[0].label == badge
        assert "no rival" not in [b.label for b in shown.badges]
        assert "pushed (sd)" not in _tables(shown, "How sure are the numbers?")[-1].header


@pytest.mark.slow
@pytest.mark.usefixtures("undrawn")
def test_where_motion_was_followed_the_spectrum_after_is_said_to_be_another(diagnosis: Diagnosis) -> None:
    explanation = diagnosis.decision.explanation
    followed = Followed(explanation.fit.measured, np.zeros(0), 1.0)
    hypothesis = replace(explanation.fit.hypothesis, followed=followed)
    corrected = replace(explanation, fit=replace(explanation.fit, hypothesis=hypothesis))
    for decision, said in (
        (diagnosis.decision, False),
        (replace(diagnosis.decision, explanation=corrected), True),
    ):
        section = where_section(replace(diagnosis, decision=decision))
        titles = [block.title for block in section.blocks if isinstance(block, Callout)]
        assert ("After, each sample is predicted from those before it" in titles) is said


@pytest.mark.slow
def test_names_are_text_in_both_forms(report: Report, tmp_path: Path) -> None:
    """The page holds the hostile name as it reads, as no tag; Typst sets it without a fault."""
    written = render(report, tmp_path)
    page = written.html.read_text(encoding="utf-8")
    assert "<script>alert" not in page
    assert "\x1b" not in page and "\u202e" not in page
    assert visible(HOSTILE) in unescape(page)
    assert "<y>$" not in page and "<y>$" in unescape(page)
    assert written.pdf.read_bytes().startswith(b"%PDF")


@pytest.mark.slow
def test_a_map_of_noise_alone_stays_near_the_floor_and_a_tone_stands_out(diagnosis: Diagnosis) -> None:
    explanation = diagnosis.decision.explanation
    noise = residual_map(explanation.fit.residuals[0], explanation)
    assert np.mean(10 ** (noise.decibels / 10)) == pytest.approx(1.0, abs=0.35)
    t = np.arange(300) / 20.0
    tone = residual_map(explanation.fit.residuals[0] + 0.1 * np.sin(2 * np.pi * 3.0 * t), explanation)
    loudest = tone.frequencies[np.argmax(tone.decibels.mean(axis=1))]
    assert loudest == pytest.approx(3.0, abs=0.4)


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True])
def test_page_in_a_browser(report: Report, browser: Browser, tmp_path: Path, dark: bool) -> None:
    page = render(report, tmp_path).html
    browser.open(page, dark=dark)
    check_page(browser)
    assert browser.evaluate("document.title") == visible(report.title)
    assert browser.evaluate("document.querySelectorAll('.live canvas').length") == 1
