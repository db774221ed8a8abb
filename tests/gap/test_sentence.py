"""Numbers of the verdict in words."""

from __future__ import annotations

import pytest

from bayes_hw.gap.sentence import _amount
from bayes_hw.gap.verdict import Estimate


@pytest.mark.parametrize(
    ("mean", "sd", "text"),
    [
        (0.98, 0.0001, "0.9800 +- 0.0001 deg"),
        (23.27, 0.19, "23.3 +- 0.2 deg"),
        (123456.0, 2300.0, "123000 +- 2000 deg"),
        (1.2e-9, 3e-10, "1.2e-09 +- 3e-10 deg"),
        (-0.4, 0.5, "-0.4 +- 0.5 deg"),
        (0.25, 0.0, "0.25 deg"),
    ],
)
def test_amounts_are_rounded_by_their_deviation(mean: float, sd: float, text: str) -> None:
    assert _amount(Estimate(mean, sd, (mean - sd, mean + sd), "deg")) == text
