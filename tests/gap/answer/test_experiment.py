"""The experiment that a verdict asks for."""

from __future__ import annotations

import pytest

from bayes_hw.gap.answer.experiment import NOTHING_IS_MISSING, REPEATED, SHOWS, experiment_for
from bayes_hw.gap.effects.labels import LABEL_BLOCKS


def test_every_label_has_its_experiment() -> None:
    assert set(SHOWS) == set(LABEL_BLOCKS)


def test_the_experiment_names_both_of_a_pair_left_open() -> None:
    text = experiment_for(("friction",), [("friction", "backlash")])
    assert SHOWS["friction"] in text and SHOWS["backlash"] in text
    assert "twice" in experiment_for(("a",), [("a", "b")])


@pytest.mark.parametrize("label", sorted(LABEL_BLOCKS))
def test_an_answer_that_stands_alone_is_confirmed(label: str) -> None:
    assert experiment_for((label,), []) == f"to confirm {label}: {SHOWS[label]}"
    assert label in experiment_for((label, "other"), [])


def test_it_is_never_empty() -> None:
    """Nor for a gap without a name, no gap at all, and an effect from outside the catalogue."""
    assert experiment_for(("other",), []) == REPEATED and "unchanged" in REPEATED
    assert experiment_for((), []) == NOTHING_IS_MISSING
    assert "twice" in experiment_for(("belt_creep",), [])
