"""What a diagnosis trains on and what is held out of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from bayes_hw.posing import Origin, Start, posed, rested
from bayes_hw.record import Record

HELD_OUT_SHARE, WHOLE_SHARE = 1 / 3, 0.4
"""Of all samples, where nobody said what to hold out: of a record's end, and up to which a record is held out
whole, since a short beginning is no record to train on."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Records to train on, those held out, how many of their first samples only lead in; in words what was
    chosen and cut."""

    train: tuple[Record, ...]
    holdout: tuple[Record, ...]
    lead: int
    notes: tuple[str, ...]


def held_out_of(
    records: Sequence[Record], holdout: Sequence[Record], start: Start = "auto", origin: Origin = "start"
) -> HeldOut:
    """Where none is given the last record is held out, or of a long one its end: about a third of all
    samples, since a structure chosen on few of them may be another one.

    What is left to train on begins where it first rests, unless `start` is "rest", and with `origin`
    "start" its angles count from there; what is held out may begin in motion. Raises InputError where no
    record comes to rest.
    """
    if holdout:
        return _from_rest_on(HeldOut(tuple(records), tuple(holdout), 0, ()), start, origin)
    *others, last = records
    samples = sum(len(record) for record in records)
    if others and len(last) <= WHOLE_SHARE * samples:
        said = f"no record was held out, so that the last, {last.name}, was: it scores and is not fitted"
        return _from_rest_on(HeldOut(tuple(others), (last,), 0, (said,)), start, origin)
    beginning, rest = last.split(1 - HELD_OUT_SHARE * samples / len(last))
    said = (
        f"no record was held out, so that the last {rest.duration_s:.3g} s of {last.name} were, a third of "
        "all samples: they score and are not fitted"
    )
    chosen = HeldOut((*others, beginning), (last,), len(beginning), (said,))
    return _from_rest_on(chosen, start, origin)


def _from_rest_on(chosen: HeldOut, start: Start, origin: Origin) -> HeldOut:
    """The choice, records to train on cut to where they first rest."""
    train, cut = rested(chosen.train, start)
    if not cut:
        return chosen
    return replace(chosen, train=posed(train, origin=origin).records, notes=(*chosen.notes, *cut))
