"""Every label is described in words."""

from __future__ import annotations

from bayes_hw.gap.effects.catalogue import catalogue
from bayes_hw.gap.effects.descriptions import DESCRIPTIONS
from bayes_hw.gap.effects.labels import LABEL_BLOCKS

RESPONSES = {effect.label for effect in catalogue()}


def test_every_label_is_described_and_its_neighbours_are_labels() -> None:
    assert set(DESCRIPTIONS) == set(LABEL_BLOCKS)
    for label, description in DESCRIPTIONS.items():
        assert set(description.neighbours) <= set(LABEL_BLOCKS) - {label}
        assert description.neighbours
        for text in (description.looks, description.remedy, *description.neighbours.values()):
            assert text[0].isupper() and text.endswith(".")


def test_noises_state_their_law_where_no_class_does() -> None:
    assert {label for label, one in DESCRIPTIONS.items() if one.law} == set(LABEL_BLOCKS) - RESPONSES
