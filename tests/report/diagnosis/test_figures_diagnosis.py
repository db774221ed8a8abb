"""Bars of a diagnosis say no more than is known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bayes_hw.gap.joint.answer.free_function import EffectView
from bayes_hw.report.diagnosis.figures_diagnosis import (
    QUANTITY_CHARACTERS,
    effect_figure,
    label_probabilities,
)
from bayes_hw.report.page.document import Figure


@pytest.mark.usefixtures("wide_only")
def test_a_probability_short_of_one_is_not_a_hundred_per_cent(
    labels_of: Callable[[Callable[[], Figure]], list[str]],
) -> None:
    probability = {"friction": 0.995, "backlash": 0.9999, "none": 0.005, "wind": 0.0}
    found = labels_of(lambda: label_probabilities(probability, ["friction"]))
    shown = {text.replace("\u00a0", " ") for text in found}
    assert {"99.5 %", "> 99.9 %"} <= shown
    assert "100.0 %" not in shown


def test_what_is_as_good_as_excluded_has_no_bar_but_the_answer_has() -> None:
    probability = {"friction": 0.9, "backlash": 0.02, "wind": 0.005, "none": 0.004}
    found = label_probabilities(probability, ["friction"])
    assert "2 more, each 0.5 % or less" in found.caption.replace("\u00a0", " ")
    assert "Bars of 2 labels" in found.alt_text
    all_shown = label_probabilities({"friction": 0.5, "backlash": 0.5}, ["friction"])
    assert "Not drawn" not in all_shown.caption


def test_a_long_quantity_of_an_effect_stands_in_lines_that_fit(
    labels_of: Callable[[Callable[[], Figure]], list[str]],
) -> None:
    quantity, x = "change of the command that the drive makes", np.linspace(-1, 1, 5)
    view = EffectView(quantity, "deg/s/s", "change asked for", "deg/s/s", x, x, 0 * x, x, x, "As read.")
    shown = labels_of(lambda: effect_figure(view))
    assert not any(quantity in text for text in shown)
    assert any(text and quantity.startswith(text) and len(text) <= QUANTITY_CHARACTERS for text in shown)
