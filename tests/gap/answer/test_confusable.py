"""What is not told apart, and the experiment that would."""

from __future__ import annotations

import pytest

from bayes_hw.gap.answer.confusable import SHOWS, confusable_pairs, next_experiment
from bayes_hw.gap.effects.labels import LABEL_BLOCKS


def test_every_label_has_its_experiment() -> None:
    assert set(SHOWS) == set(LABEL_BLOCKS)


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


def test_the_experiment_names_both() -> None:
    text = next_experiment(("friction",), [("friction", "backlash")])
    assert text is not None and SHOWS["friction"] in text and SHOWS["backlash"] in text
    assert "repeat" in str(next_experiment(("other",), []))
    assert next_experiment(("friction",), []) is None
    assert "twice" in str(next_experiment(("a",), [("a", "b")]))
