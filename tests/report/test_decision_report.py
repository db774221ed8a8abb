"""The report of fitted constants says which of them go with the program, and holds every one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from blind_check.ballot import Ballot
from blind_check.calibrate import BY_HAND, CalibrationCase, CalibrationFit, moved, names_fitted
from blind_check.tails import TailFit
from pages.decision_report import bins, decision_report, profiles, stated_of_blocks
from strokes import draw_strokes

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.judgement import Claim, Judgement, Remains
from bayes_hw.provenance import provenance
from bayes_hw.report.page.document import Figure, Paragraph, Report, Table

TAILS = TailFit(list(np.random.default_rng(1).standard_t(4.0, (50, 8))))


def judgement(friction: float, answer: tuple[str, ...]) -> Judgement:
    return Judgement(answer, {"none": 1 - friction, "friction": friction}, {}, {})


@pytest.fixture(scope="module")
def fit() -> CalibrationFit:
    """Three cases with friction and one without: by hand 60 % sure of it, fitted and left out 75 %."""
    ballot = Ballot({(): Claim(0.0)}, {(): Remains(())}, ("friction",))
    cases = [CalibrationCase.of(ballot, effects) for effects in (["friction"],) * 3 + ([],)]
    by_hand = (judgement(0.6, ("friction",)),) * 4
    sure = (judgement(0.75, ("friction",)),) * 4
    fitted = moved(BY_HAND, {"temperature": -0.5})
    profiles = {name: (by_hand_values(name), by_hand_values(name)) for name in names_fitted()}
    gains = {5: (0.1, 0.02), 19: (0.11, 0.04)}
    return CalibrationFit(tuple(cases), fitted, by_hand, sure, sure, profiles, ("temperature",), gains)


@pytest.fixture(scope="module")
def report(fit: CalibrationFit) -> Report:
    with pytest.MonkeyPatch.context() as patch:
        draw_strokes(patch)
        return decision_report(fit, TAILS, {"easy": ([1910], 4)}, provenance("test", 1, [], 0.0))


def by_hand_values(name: str) -> FloatArray:
    return getattr(BY_HAND, name) * np.array([0.5, 1.0, 2.0])


@pytest.mark.parametrize(("worse", "said", "level"), [
    (False, "better than those by hand", "good"),
    pytest.param(True, "no better than those by hand", "warn", marks=pytest.mark.slow),
])  # fmt: skip
@pytest.mark.usefixtures("undrawn")
def test_what_goes_with_the_program_is_said_first(
    fit: CalibrationFit, report: Report, worse: bool, said: str, level: str
) -> None:
    if worse:
        shown = replace(fit, by_hand=fit.left_out, left_out=fit.by_hand)
        report = decision_report(shown, TAILS, {"easy": ([1910], 4)}, provenance("test", 1, [], 0.0))
    assert said in report.verdict
    assert ("those by hand go with the program" in report.verdict) == worse
    assert report.badges[0].state == level
    assert "by hand 3 of 4" in report.verdict.replace("\u00a0", " ")


def test_every_constant_has_its_row(report: Report) -> None:
    table = next(block for block in report.sections[0].blocks if isinstance(block, Table))
    assert [row[0] for row in table.rows] == list(names_fitted())
    assert table.rows[0][2:] == ("6", "4.24")


@pytest.mark.slow
def test_every_constant_has_its_panel_and_no_panel_is_empty(fit: CalibrationFit) -> None:
    assert profiles(fit).svg.count("<clipPath id=") == len(names_fitted())


def test_statements_are_counted_by_what_is_true(fit: CalibrationFit) -> None:
    """0.75 of friction is true in 3 of 4; 0.25 of none in 1 of 4."""
    assert sorted((item.mean, item.share.hits) for item in bins(fit, fit.left_out)) == [(0.25, 1), (0.75, 3)]


def test_blocks_are_counted_where_there_is_one_effect(fit: CalibrationFit) -> None:
    """Two of one effect, drive and sensor; stated 0.8 and 0.6 of drive; the third has none."""
    cases = [replace(fit.cases[0], block=block) for block in ("drive", "sensor", "")]
    stated = [replace(fit.left_out[0], blocks={"drive": p, "sensor": 1 - p}) for p in (0.8, 0.6, 0.9)]
    hits, mean = stated_of_blocks(replace(fit, cases=tuple(cases)), stated)
    assert (hits.hits, hits.trials, mean) == (1, 2, pytest.approx(0.7))


def test_coverage_of_base_parameters_is_said(report: Report) -> None:
    section = next(item for item in report.sections if "base parameters" in item.title)
    text = section.blocks[0]
    alone, with_tails = TAILS.held()
    assert isinstance(text, Paragraph) and isinstance(section.blocks[1], Figure)
    assert f"{alone.hits} of 400" in text.text and f"{with_tails.hits} of 400" in text.text


def test_the_gains_of_every_fit_are_said_and_what_was_fitted(report: Report) -> None:
    said = next(block.text for block in report.sections[0].blocks if isinstance(block, Paragraph))
    assert "5 constants fitted, 0.100 ± 0.020 nats; 19 constants fitted, 0.110 ± 0.040 nats" in said
    assert "fewest constants, 1, that scores within a standard error of the best: temperature." in said
