"""The page on records alone says first what is missing, in words of the field, and folds the rest."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from browser import Browser
from page_checks import check_page

from bayes_hw.gap.joint.joint_diagnosis import JointDiagnosis, diagnose_records
from bayes_hw.provenance import provenance
from bayes_hw.report.axis.axis_sight import axis_sight, velocity_step
from bayes_hw.report.diagnosis.joint_report import joint_report
from bayes_hw.report.page.document import Report
from bayes_hw.report.page.render import render

sys.path.insert(0, str(Path(__file__).parents[2] / "gap" / "joint"))
from joint_axis import measured


@pytest.fixture(scope="module")
def diagnosis() -> JointDiagnosis:
    """Of an axis that lacks nothing."""
    records = measured((), 600, (1, 2, 3))
    rng = np.random.default_rng(1)
    return diagnose_records(records[:2], records[2:], rng, name="azimuth <b>", start="rest")


def page_of(diagnosis: JointDiagnosis) -> Report:
    return joint_report(diagnosis, provenance("bayes-hw diagnose", 1, diagnosis.train, 1.0))


def answering(diagnosis: JointDiagnosis, answer: tuple[str, ...], sure: float) -> JointDiagnosis:
    probability = {**diagnosis.verdict.probability, **dict.fromkeys(answer, sure)}
    return replace(diagnosis, verdict=replace(diagnosis.verdict, answer=answer, probability=probability))


@pytest.fixture(scope="module")
def friction(diagnosis: JointDiagnosis) -> Report:
    """The page of an answer of which it is sure."""
    return page_of(answering(diagnosis, ("friction",), 0.995))


@pytest.mark.usefixtures("undrawn")
def test_nothing_missing_is_said_with_its_probability(diagnosis: JointDiagnosis) -> None:
    assert diagnosis.verdict.answer == ()
    said = diagnosis.sentence()
    assert said.startswith("The axis follows commands up to -0.3") and "swings at 2.0" in said
    assert "nothing is missing" in said and "% sure" in said
    page = page_of(diagnosis)
    assert len(page.badges) == 4 and page.badges[0].state == "good"


def test_lines_of_the_axis_are_the_middle_of_their_bands(diagnosis: JointDiagnosis) -> None:
    """Also where the draws are about another place than the explanation that was chosen."""
    drawn = diagnosis.posterior.coordinates
    away = replace(diagnosis.posterior, coordinates=drawn + 3 * (drawn[0] - drawn.mean(axis=0)))
    sight, step = axis_sight(diagnosis.train, away), velocity_step(diagnosis.train, away)
    assert (sight.low <= sight.model).all() and (sight.model <= sight.high).all()
    assert (step.low <= step.velocity).all() and (step.velocity <= step.high).all()
    own = axis_sight(diagnosis.train, diagnosis.posterior)
    assert np.median(own.model[own.frequency_hz < 0.5]) == pytest.approx(1.0, abs=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("sure", [0.995, 0.6])
@pytest.mark.usefixtures("undrawn")
def test_the_card_and_the_sentence_state_one_probability(
    diagnosis: JointDiagnosis, friction: Report, sure: float
) -> None:
    found = answering(diagnosis, ("friction",), sure)
    page = friction if sure == 0.995 else page_of(found)
    assert f"friction ({100 * sure:.3g} % sure)" in found.sentence()
    assert page.badges[0].detail.replace("\u00a0", " ").startswith(f"{100 * sure:.1f} % sure")
    assert page.badges[0].state == ("good" if sure > 0.9 else "warn")


@pytest.mark.usefixtures("undrawn")
def test_numbers_beside_an_unknown_cause_are_marked_and_folded(diagnosis: JointDiagnosis) -> None:
    page = page_of(answering(diagnosis, ("other",), 0.97))
    assert page.badges[0].label == "cause unknown" and page.badges[0].state == "bad"
    numbers = next(section for section in page.sections if section.title == "How sure are the numbers?")
    assert numbers.folded
    assert "does not hold" in repr(numbers.blocks[0])


@pytest.mark.slow
@pytest.mark.parametrize("dark", [False, True])
def test_page_in_a_browser(friction: Report, browser: Browser, tmp_path: Path, dark: bool) -> None:
    written = render(friction, tmp_path)
    browser.open(written.html, dark=dark)
    assert browser.evaluate("document.querySelectorAll('details:not([open])').length") >= 3
    check_page(browser)
