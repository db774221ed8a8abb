"""A spoilt truth must be noticed: the score falls to what is worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from blind_cases import truth, verdict

from bayes_hw.gap.blind.mutation import mutations, shuffled, swapped, swapped_most_frequent


def test_shuffled_verdicts_score_their_expectation() -> None:
    """Three winds, two nothings, all right: each wind verdict fits 3 truths, each nothing 2: (9 + 4) / 5."""
    truths = [truth("wind")] * 3 + [truth()] * 2
    verdicts = [verdict("wind")] * 3 + [verdict()] * 2
    found = shuffled(truths, verdicts, np.random.default_rng(1))
    assert found.before == 5
    assert found.expected == pytest.approx(2.6)
    assert found.passed
    assert 0 < found.tolerance < 0.3


def test_shuffling_in_place_would_be_noticed() -> None:
    """Verdicts that are not shuffled at all leave the tolerance."""
    found = shuffled([truth("wind"), truth()] * 5, [verdict("wind"), verdict()] * 5, np.random.default_rng(1))
    assert found.before - found.expected > found.tolerance


def test_swapped_labels_by_hand() -> None:
    """2 winds right, 1 taken for friction, 1 friction right: 3 before; after the swap the 1 confusion."""
    truths = [truth("wind")] * 3 + [truth("friction")]
    verdicts = [verdict("wind"), verdict("wind"), verdict("friction"), verdict("friction")]
    found = swapped(truths, verdicts, "wind", "friction")
    assert (found.before, found.expected, found.found) == (3, 1, 1)
    assert found.passed


def test_swap_leaves_pairs_alone() -> None:
    found = swapped([truth("wind", "friction")], [verdict("wind", "friction")], "wind", "friction")
    assert (found.before, found.expected, found.found) == (1, 1, 1)


def test_swap_chooses_the_two_most_often_right() -> None:
    truths = [truth("wind")] * 2 + [truth("friction")] * 2 + [truth("outliers")]
    (found,) = swapped_most_frequent(truths, [verdict(*t.effects) for t in truths])
    assert found.name == "wind and friction swapped in the truth"
    assert swapped_most_frequent(truths[:2], [verdict("wind")] * 2) == []


def test_both_are_made() -> None:
    truths = [truth("wind"), truth("friction"), truth()]
    made = mutations(truths, [verdict(*t.effects) for t in truths], np.random.default_rng(2))
    assert [m.passed for m in made] == [True, True]
