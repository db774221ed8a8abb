"""The reports of the blind studies say their numbers, and both outputs can be made of them."""

from __future__ import annotations

import numpy as np
import pytest
from blind_check.check import joined
from blind_check.leave_out import LeftOut
from blind_check.power import SmallestGap
from pages.leave_out_report import leave_out_report
from pages.power_report import PowerStudy, gap_text, power_report

from bayes_hw.gap.blind.counts import Share
from bayes_hw.gap.blind.evidence import CaseTruth, CaseVerdict, Evidence
from bayes_hw.gap.blind.score import score_evidence
from bayes_hw.provenance import provenance
from bayes_hw.report.blind.blind_report import blind_report, share_text
from bayes_hw.report.blind.figures_blind import shares
from bayes_hw.report.page.content import report_content
from bayes_hw.report.page.document import Report
from bayes_hw.report.page.palette import BLUE, ORANGE, VERMILLION
from bayes_hw.report.page.render import to_html

ORIGIN = provenance("bayes-hw blind score", 1, [], 1.0)


def texts(report: Report) -> str:
    """Every string of the document but its pictures."""
    content = report_content(report)
    for section in content["sections"]:
        for block in section["blocks"]:
            block.pop("svg", None)
    return repr({key: value for key, value in content.items() if key != "key_figure"})


def test_blind_report_names_what_was_wrong() -> None:
    """Two of three right: the shares, the wrong case with its answer, and the seal are on the page."""
    cases = (("wind",), ("wind",), ("friction",), ())
    truths = tuple(
        CaseTruth(f"case_{i:04d}", effects, effects, (1.5,) * len(effects), {}, 0.0, np.zeros(2))
        for i, effects in enumerate(cases)
    )
    said = (("wind",), ("wind",), ("backlash",), ())
    verdicts = tuple(
        CaseVerdict(
            answer,
            dict.fromkeys(answer or ("none",), 0.97),
            before=np.ones(2),
            after=np.full(2, 0.5),
            closed=0.7,
            closed_interval=(0.5, 0.8),
        )
        for answer in said
    )
    evidence = Evidence(truths, verdicts, "5ea1" * 16, "d16e" * 16, "module:function")
    report = blind_report(score_evidence(evidence, np.random.default_rng(1)), evidence, ORIGIN)
    shown = texts(report)
    assert "2 of 3" in shown
    assert "case_0002" in shown
    assert "backlash" in shown
    assert "5ea1" * 16 in shown
    states = [badge.state for badge in report.badges]
    assert len(states) == 4 and states == sorted(states, key=["bad", "warn", "good"].index)
    assert states[0] != "good" and "97" in shown
    assert "case_0000" not in shown
    assert "Confusion matrix" in to_html(report)


@pytest.mark.slow
def test_of_right_answers_to_an_open_truth_no_empty_table_is_shown() -> None:
    truth = CaseTruth("case_0000", ("wind",), ("wind",), (1.5,), {}, 0.0, np.zeros(2))
    verdict = CaseVerdict(("wind",), {"wind": 0.97}, before=np.ones(2), after=np.ones(2) / 2, closed=0.7)
    open_set = Evidence((truth,), (verdict,), "", "d16e" * 16, "module:function")
    evidence = joined([open_set, open_set])
    shown = texts(blind_report(score_evidence(evidence, np.random.default_rng(1)), evidence, ORIGIN))
    assert "None of 2 cases" in shown and "'stated'" not in shown
    assert "the truth lay open" in shown


def test_share_text() -> None:
    assert share_text(Share(9, 10)) == "9 of 10, 90 % [55, 100]".replace(" %", "\u00a0%")
    assert share_text(Share(180, 200)) == "180 of 200, 90.0 % [85.0, 93.8]".replace(" %", "\u00a0%")
    assert share_text(Share(0, 0)) == "no case"


def test_power_report_states_bounds_in_words() -> None:
    gaps = {
        "wind": SmallestGap(1.25, (0.9, float("inf")), 40),
        "friction": SmallestGap(0.7, (0.0, 2.0), 40),
    }
    study = PowerStudy(gaps, {"120 s": gaps["wind"]}, "120 s", {"wind": [(0.5, False), (2.0, True)]})
    assert gap_text(gaps["wind"]) == "1.25 [0.90, beyond those tried]"
    shown = texts(power_report(study, ORIGIN))
    assert "from a gap of 1.25 times the noise on" in shown and "0.90 to beyond those tried" in shown
    assert "1 of 2 effects have an upper bound" in shown and "friction with 2.00" in shown


def test_leave_out_report_counts() -> None:
    row = LeftOut(
        "wind",
        Share(3, 4),
        Share(4, 4),
        Share(2, 4),
        0.61,
        Share(4, 4),
        0.1,
        0.8,
        0.9,
        (("other", 3), ("friction", 1)),
    )
    report = leave_out_report([row], ORIGIN)
    assert [badge.state for badge in report.badges] == ["good", "bad", "good"]
    shown = texts(report)
    assert "4 of 4" in shown
    assert "other 3, friction 1" in shown
    assert "1 of 1 effects close more" in shown
    assert "its block is right in 2" in shown and "right in 2 of 4, 50" in shown and "61" in shown


def test_a_set_without_single_effects_has_its_figure() -> None:
    """No row to draw, and no warning."""
    assert "0 groups" in shares({}, "Nothing").alt_text


def test_a_share_below_the_goal_never_has_the_colour_of_one_that_met_it() -> None:
    def colours(share: Share) -> set[str]:
        svg = shares({"friction": share}, "Single effects", 0.97).svg.upper()
        return {colour for colour in (BLUE, ORANGE, VERMILLION) if colour.upper() in svg}

    assert colours(Share(14, 14)) == {BLUE}
    assert colours(Share(9, 11)) == {ORANGE}
    assert colours(Share(14, 16)) == {ORANGE}
    assert colours(Share(5, 11)) == {VERMILLION}
