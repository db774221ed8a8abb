"""Which of the records are trained on and which are held out, where nobody said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bayes_hw.record import Record

TRAINED_SHARE = 2 / 3
"""Of a single record; the rest is held out."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Records to train on, those held out, how many of their first samples only lead in, and what was chosen
    in words, empty where it was given."""

    train: tuple[Record, ...]
    holdout: tuple[Record, ...]
    lead: int
    said: str


def held_out_of(records: Sequence[Record], holdout: Sequence[Record]) -> HeldOut:
    """Of several records the last is held out where none is given, of one its last third."""
    if holdout:
        return HeldOut(tuple(records), tuple(holdout), 0, "")
    last = records[-1]
    if len(records) > 1:
        said = f"no record was held out, so that the last, {last.name}, was: it scores and is not fitted"
        return HeldOut(tuple(records[:-1]), (last,), 0, said)
    beginning, rest = last.split(TRAINED_SHARE)
    said = f"no record was held out, so that the last third of {last.name} was: it scores and is not fitted"
    return HeldOut((beginning,), (last,), len(last) - len(rest), said)
