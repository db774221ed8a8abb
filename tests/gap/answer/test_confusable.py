"""What is not told apart."""

from __future__ import annotations

import pytest

from bayes_hw.gap.answer.confusable import confusable_pairs


@pytest.mark.parametrize(
    ("answer", "found"),
    [
        (("friction",), [("friction", "backlash")]),
        (("friction", "wind"), [("wind", "sensor_drift")]),
        ((), []),
        (("other",), []),
    ],
)
def test_rivals_stand_in_the_place_of_one_label(
    answer: tuple[str, ...], found: list[tuple[str, str]]
) -> None:
    """Within six nats, of the same number of labels, one of them another."""
    scores = {
        (): 0.0,
        ("friction",): 100.0,
        ("backlash",): 95.0,
        ("wind",): 90.0,
        ("friction", "wind"): 200.0,
        ("friction", "sensor_drift"): 199.0,
        ("backlash", "cubic_stiffness"): 199.0,
    }
    assert confusable_pairs(answer, scores, 6.0) == found
