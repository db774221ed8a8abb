"""What is held out of records where nobody said."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bayes_hw.posing import Start, posed, rested
from bayes_hw.record import Record

HELD_OUT_SHARE, WHOLE_SHARE = 1 / 3, 0.4
"""Of all samples, where nobody said what to hold out: of a record's end, and up to which a record is held out
whole, since a short beginning is no record to train on."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Records to train on, those held out, how many of their first samples only lead in, and what was chosen
    in words, empty where it was given."""

    train: tuple[Record, ...]
    holdout: tuple[Record, ...]
    lead: int
    said: str

    @property
    def notes(self) -> tuple[str, ...]:
        """What was chosen, for the notes: none where it was given."""
        return (self.said,) if self.said else ()


def held_out_of(records: Sequence[Record], holdout: Sequence[Record]) -> HeldOut:
    """Where none is given the last record is held out, or of a long one its end: about a third of all
    samples, since a structure chosen on few of them may be another one."""
    if holdout:
        return HeldOut(tuple(records), tuple(holdout), 0, "")
    *others, last = records
    samples = sum(len(record) for record in records)
    if others and len(last) <= WHOLE_SHARE * samples:
        said = f"no record was held out, so that the last, {last.name}, was: it scores and is not fitted"
        return HeldOut(tuple(others), (last,), 0, said)
    beginning, rest = last.split(1 - HELD_OUT_SHARE * samples / len(last))
    said = (
        f"no record was held out, so that the last {rest.duration_s:.3g} s of {last.name} were, a third of "
        "all samples: they score and are not fitted"
    )
    return HeldOut((*others, beginning), (last,), len(beginning), said)


def from_rest_on(chosen: HeldOut, start: Start) -> tuple[HeldOut, tuple[str, ...]]:
    """The same, records to train on that begin in motion cut to where they first rest, their angles counted
    from there; in words what was cut.

    Raises InputError where one does not come to rest in its first half.
    """
    train, cut = rested(chosen.train, start)
    if not cut:
        return chosen, ()
    return replace(chosen, train=posed(train).records), cut
