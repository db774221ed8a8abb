"""Phrases as people say them."""

from __future__ import annotations

import pytest

from bayes_hw.phrases import in_percent, listed, plainly, with_article


@pytest.mark.parametrize(
    ("share", "said"),
    [(0.0123, "1.2 %"), (1.0, "100 %"), (1.36, "140 %"), (0.0, "0 %"), (3e-5, "0.003 %"), (0.996, "100 %")],
)
def test_a_share_has_two_digits_and_no_exponent(share: float, said: str) -> None:
    assert in_percent(share) == said


def test_an_article_goes_with_its_noun() -> None:
    assert with_article("damping ratio") == "a damping ratio"
    assert with_article("excess of static friction") == "an excess of static friction"


def test_the_last_of_several_is_joined_by_and() -> None:
    assert listed(["a"]) == "a"
    assert listed(["a", "b", "c"]) == "a, b and c"


@pytest.mark.parametrize(
    ("value", "text"), [(5604.16, "5600"), (-5604.16, "-5600"), (1.7984, "1.8"), (0.000123, "0.00012")]
)
def test_a_number_without_a_power_of_ten(value: float, text: str) -> None:
    assert plainly(value, 2) == text
