"""What commands say: numbers as their uncertainty allows."""

from __future__ import annotations

import pytest

from bayes_hw.commands.speech import rounded


@pytest.mark.parametrize(("value", "sd", "text"), [
    (-0.400937, 0.0013, "-0.4009"),
    (0.0013, 0.0013, "0.0013"),
    (1.65562, 0.0311, "1.656"),
    (12345.6, 35.0, "12346"),
    (12345.6, 350.0, "12350"),
    (5.70149e-8, 2.4e-13, "5.701490e-08"),
    (2.4e-13, 2.4e-13, "2.4e-13"),
    (0.0, 0.02, "0.000"),
    (1.5, 0.0, "1.5"),
    (1.5, float("nan"), "1.5"),
    (float("inf"), 0.1, "inf"),
])  # fmt: skip
def test_rounded_at_the_second_digit_of_the_uncertainty(value: float, sd: float, text: str) -> None:
    assert rounded(value, sd) == text
