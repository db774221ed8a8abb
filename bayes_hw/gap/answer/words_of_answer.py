"""The labels of an answer in words, each with how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.effects.words import label_words


def words_of(label: str) -> str:
    """A label as it is said in a sentence."""
    return "something that none of the known effects explains" if label == OTHER else label_words(label)


def percent(probability: float) -> str:
    """A probability, never rounded up to certainty."""
    return f"{min(100 * probability, 99.9):.3g} %"


def words_of_answer(answer: Sequence[str], probability: Mapping[str, float]) -> str:
    """The labels of an answer with how sure each is, where that is known."""
    return " and ".join(
        f"{words_of(label)} ({percent(probability[label])} sure)" if label in probability else words_of(label)
        for label in answer
    )
