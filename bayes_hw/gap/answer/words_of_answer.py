"""The labels of an answer in words, each with how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from bayes_hw.gap.answer.judgement import OTHER
from bayes_hw.gap.answer.verdict import Verdict
from bayes_hw.gap.effects.words import label_words

DISAGREES = 3.0
"""Error of the answer's model on the records held out, over that on those it was fitted to, from which it is
said first: answers that hold have 1, those whose noise wanders up to 2."""


def disagreement(verdict: Verdict) -> str:
    """What is to be said before all else where the answer's model fails on the records held out, with a blank
    behind; empty where it does not."""
    fitted, held_out = verdict.gap_train.rmse_after, verdict.gap_holdout.rmse_after
    if held_out < DISAGREES * fitted:
        return ""
    return (
        f"Model and record held out disagree: its error there is {held_out / fitted:.2g} times that on the "
        "records it was fitted to, and what follows holds for those at most. "
    )


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
