"""Records as models take them: angles that count from where the record begins, and how it starts.

A model's axis stands at zero before its first command. A record of an azimuth begins at 134.2 deg, or in the
midst of a slew; what is estimated from it must not depend on that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias, get_args

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.quantities import output_word
from bayes_hw.record import Record
from bayes_hw.record_start import FEWEST_REST_SAMPLES, RecordStart, begins_in_motion, record_start

Origin: TypeAlias = Literal["start", "absolute"]
Start: TypeAlias = Literal["auto", "rest", "free"]

REST_S = 1.0
"""Command zero and axis still for so long: from there on a record begins at rest."""

LEAST_SHARE = 0.5
"""Of a record that must remain where it is cut to begin at rest."""


@dataclass(frozen=True, eq=False)
class Posed:
    """Records with angles that count as asked, how they start, and in words what was done to each of them.

    `start` is "free" where one of `records`, not of `holdout`, begins in motion or away from zero.
    """

    records: tuple[Record, ...]
    holdout: tuple[Record, ...]
    start: Literal["rest", "free"]
    notes: tuple[str, ...]


def posed(
    records: Sequence[Record],
    holdout: Sequence[Record] = (),
    *,
    origin: Origin = "start",
    start: Start = "auto",
) -> Posed:
    """Count every record's angles from its beginning (`origin` "start"), and find out how it starts.

    A record that begins at zero within the noise is left as it is, to the last bit, and speeds count from
    zero whatever `origin` says. With `start` "auto" the initial state is free where a record to estimate from
    begins in motion, or, with `origin` "absolute", away from zero; "rest" and "free" are taken as given.
    Raises InputError on another `origin` or `start`.
    """
    for name, given, known in (("origin", origin, get_args(Origin)), ("start", start, get_args(Start))):
        if given not in known:
            raise InputError(f"{name}={given!r}: unknown; use one of {', '.join(known)}")
    if any(record.measures_speed for record in (*records, *holdout)):
        origin = "absolute"
    notes: list[str] = []
    done: list[Record] = []
    free = start == "free"
    for number, record in enumerate((*records, *holdout)):
        if not record.has_output:
            done.append(record)
            continue
        begin = record_start(record.u, record.y, record.sample_rate_hz, record.measured)
        away = not begin.is_zero and origin == "absolute"
        if start == "auto" and (begin.moving or away):
            free = free or number < len(records)
            notes.append(f"{record.name}: {_how_it_begins(record, begin)}; its initial state is estimated")
        elif start == "rest" and away:
            how = _how_it_begins(record, begin)
            notes.append(f"{record.name}: {how} and is taken to begin at zero all the same")
        if origin == "start" and (not begin.is_zero or record.level_sd > 0):
            record = counted_from(record, begin)
            notes.append(f"{record.name}: {record.treatment[-1]}")
        done.append(record)
    count = len(records)
    return Posed(tuple(done[:count]), tuple(done[count:]), "free" if free else "rest", tuple(notes))


def counted_from(record: Record, begin: RecordStart) -> Record:
    """The record with angles that count from its level at the beginning; its treatment says so."""
    place = max(0, 1 - math.floor(math.log10(begin.level_sd))) if begin.level_sd > 0 else 6
    level = round(begin.level, min(place, 12))
    unit = record.units.output
    where = "the first sample" if begin.samples == 1 else f"mean of the first {begin.samples} samples"
    known = (
        "" if begin.samples >= FEWEST_REST_SAMPLES else ", few: let records begin with some seconds at rest"
    )
    if begin.samples == 0:
        where, known = "the first reading", ", nothing having been measured before it"
    sentence = (
        f"{output_word(unit)}s count from {level:.10g} {unit}, where the record begins ({where}, known to "
        f"{begin.level_sd:.1g} {unit}{known})"
    )
    return replace(
        record.counted_from(level),
        level_sd=begin.level_sd,
        treatment=(*record.treatment, sentence),
    )


def begins_unmeasured(record: Record) -> bool:
    """Whether the level of a record is known only from what its axis does later."""
    return record.has_free_level and not record.measured_samples[0]


def at_level(outputs: FloatArray, record: Record) -> FloatArray:
    """Simulated outputs (..., samples) at the level that the readings of a record show, where nothing was
    measured when it began; else as they are."""
    if not begins_unmeasured(record):
        return outputs
    measured = record.measured_samples
    return outputs + np.mean(record.y[measured] - outputs[..., measured], axis=-1, keepdims=True)


def _how_it_begins(record: Record, begin: RecordStart) -> str:
    if begin.moving:
        return "begins in motion"
    return f"begins at {begin.level:.6g} {record.units.output}"


def rested(records: Sequence[Record], start: Start = "auto") -> tuple[tuple[Record, ...], tuple[str, ...]]:
    """The records from where each first rests, and in words what was cut; with `start` "rest" as they are.

    One that comes to rest too late, such as the second part of a log that was split while the axis moved, is
    left out where another remains. Raises InputError as `from_rest` does where none does.
    """
    if start == "rest" or not records:
        return tuple(records), ()
    resting = tuple(record for record in records if first_rest(record) is not None) or records
    notes = [
        f"{record.name}: left out, begins in motion and comes to rest nowhere in its first half; a diagnosis "
        "starts at rest (--start rest takes it so)"
        for record in records
        if record not in resting
    ]
    found = tuple(from_rest(record) for record in resting)
    notes += [
        f"{after.name}: {after.treatment[-1]}"
        for before, after in zip(resting, found, strict=True)
        if after is not before
    ]
    return found, tuple(notes)


def first_rest(record: Record) -> int | None:
    """The sample at which a record first rests, zero where it begins so, or may have been moved by a known
    signal; None where less than half of it remains behind."""
    if record.known or not begins_in_motion(record.u, record.y, record.sample_rate_hz):
        return 0
    first = _first_rest(record)
    return None if first is None or len(record) - first < LEAST_SHARE * len(record) else first


def from_rest(record: Record) -> Record:
    """The record from where it first rests, where it begins in motion; its treatment says so.

    Raises InputError where less than half of it remains.
    """
    first = first_rest(record)
    if first == 0:
        return record
    if first is None:
        raise InputError(
            f"{record.source or record.name}: begins in motion, and comes to rest nowhere in its first "
            "half; a diagnosis starts at rest: give a record that begins at rest, or --start rest to "
            "take it so"
        )
    rate = record.sample_rate_hz
    found = record.window(first / rate, math.inf)
    sentence = f"begins in motion: the first {first / rate:.4g} s, up to where it rests, left out"
    return replace(found, name=record.name, treatment=(*record.treatment, sentence))


def _first_rest(record: Record) -> int | None:
    """The sample after the first `REST_S` with no command in which the axis stands still; None without."""
    length = max(round(REST_S * record.sample_rate_hz), 4)
    moves = np.concatenate([[0], np.cumsum(record.u != 0)])
    usual = float(np.sqrt(np.mean(np.diff(record.y[:: length // 2]) ** 2)))
    for first in range(length, len(record) - length):
        still = moves[first] == moves[first - length]
        half = length // 2
        if still and abs(record.y[first] - record.y[first - half]) < 0.05 * usual:
            return first
    return None
