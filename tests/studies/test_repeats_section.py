"""The first page of a repeated analysis says how often its intervals held, good or bad."""

from __future__ import annotations

import pytest
from pages.repeats_section import Repeats, with_repeats
from rank_statistics import IntervalCoverage

from bayes_hw.report.page.document import Badge, Figure, Paragraph, Report, Section

FIGURE = Figure("<svg xmlns='http://www.w3.org/2000/svg'/>", "caption", "alt")


def page(delta: int) -> Report:
    held = {
        "saturation.upper": IntervalCoverage(0.94, 29, 30),
        "dead_zone.half_width": IntervalCoverage(0.94, delta, 30),
    }
    before = Report(
        "twin", "", "Good.", (), FIGURE, (Section("A", (Paragraph("a"),)), Section("Provenance", ()))
    )
    return with_repeats(before, Repeats(30, 28, held, {"saturation.upper": 1.04}))


@pytest.mark.parametrize(("delta", "state"), [(28, "good"), (12, "bad")])
def test_the_first_page_says_how_often_the_intervals_held(delta: int, state: str) -> None:
    report = page(delta)
    assert f"{29 + delta} of 60 94 % intervals held the truth" in report.verdict
    assert f"with {delta} of 30); 28 of 30 samplers converged." in report.verdict
    assert report.badges[-1].state == state
    assert [section.title for section in report.sections] == [
        "A",
        "How often the intervals hold",
        "Provenance",
    ]


def test_four_cards_at_most_and_what_is_good_makes_room() -> None:
    held = {"saturation.upper": IntervalCoverage(0.94, 29, 30)}
    cards = tuple(Badge(name, "bad" if name == "d" else "good", "") for name in "abcd")
    before = Report("twin", "", "Good.", cards, FIGURE, (Section("A", ()), Section("Provenance", ())))
    after = with_repeats(before, Repeats(30, 28, held, {"saturation.upper": 1.04}))
    assert [badge.label for badge in after.badges] == ["a", "b", "d", "intervals over 30 seeds"]
