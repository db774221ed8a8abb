"""Bars of a diagnosis say no more than is known."""

from __future__ import annotations

from collections.abc import Callable

from bayes_hw.report.diagnosis.figures_diagnosis import label_probabilities
from bayes_hw.report.page.document import Figure


def test_a_probability_short_of_one_is_not_a_hundred_per_cent(
    labels_of: Callable[[Callable[[], Figure]], list[str]],
) -> None:
    probability = {"friction": 0.995, "backlash": 0.9999, "none": 0.005, "wind": 0.0}
    found = labels_of(lambda: label_probabilities(probability, ["friction"]))
    shown = {text.replace("\u00a0", " ") for text in found}
    assert {"99.5 %", "> 99.9 %", "0.5 %", "0.0 %"} <= shown
    assert "100.0 %" not in shown
