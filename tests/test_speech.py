"""What commands say: numbers as their uncertainty allows."""

from __future__ import annotations

import pytest

from bayes_hw.commands.speech import say_estimate
from bayes_hw.phrases import rounded


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


def test_a_number_without_spread_is_said_to_be_held(capsys: pytest.CaptureFixture[str]) -> None:
    """Not to be certain to the last digit."""
    say_estimate("backlash.half_gap", 0.0142999169816, 0.0, (0.0142999169816, 0.0142999169816), "deg")
    say_estimate("gain", 0.0123, 0.0011, (0.0102, 0.0144), "")
    held, free = capsys.readouterr().out.splitlines()
    assert held.split(maxsplit=1)[1] == "0.0143 deg, held"
    assert free.split(maxsplit=1)[1] == "0.0123 +- 0.0011, 94 % HDI [0.0102, 0.0144]"
