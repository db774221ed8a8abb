"""Numbers of the verdict in words."""

from __future__ import annotations

import pytest

from bayes_hw.gap.answer.sentence import _amount, consequence
from bayes_hw.gap.answer.shrink import Closure
from bayes_hw.gap.answer.verdict import Estimate


@pytest.mark.parametrize(
    ("mean", "sd", "text"),
    [
        (0.98, 0.0001, "0.9800 +- 0.0001 deg"),
        (23.27, 0.19, "23.3 +- 0.2 deg"),
        (123456.0, 2300.0, "123000 +- 2000 deg"),
        (1.2e-9, 3e-10, "1.2e-09 +- 3e-10 deg"),
        (-0.4, 0.5, "-0.4 +- 0.5 deg"),
        (0.25, 0.0, "0.25 deg"),
        (0.06311144, 6e-8, "0.063111 deg"),
    ],
)
def test_amounts_are_rounded_by_their_deviation(mean: float, sd: float, text: str) -> None:
    assert _amount(Estimate(mean, sd, (mean - sd, mean + sd), "deg")) == text


@pytest.mark.parametrize(
    ("tracked", "text"),
    [
        (True, "With it in the model, 88 % [83, 92] of the avoidable error on the record held out is gone."),
        (
            False,
            "No simulation follows it: what knowing of it improves is the band and the model's own numbers, "
            "by which 88 % [83, 92] of the avoidable error on the record held out are gone.",
        ),
    ],
)
def test_what_is_random_is_not_said_to_be_removed(tracked: bool, text: str) -> None:
    gap = Closure(0.3, 0.1, 0.01, 0.88, (0.83, 0.92))
    assert consequence(gap, "it", tracked) == text
