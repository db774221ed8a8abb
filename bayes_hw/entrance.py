"""What every command and every function does with records first: look for mistakes, then pose them.

One check for the command line and for Python, before anything is fitted.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import combinations
from typing import Protocol

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.following import Following, following, relation
from bayes_hw.posing import Origin, Posed, Start, posed
from bayes_hw.quantities import speed_of, spelt
from bayes_hw.record import Record, Units
from bayes_hw.record_checks import Finding
from bayes_hw.scale_checks import mistakes_of, wrong_scale

RATE_TOLERANCE = 0.01
"""Largest relative difference of the sample rates of a model and a record."""

FAR_BEYOND = 30.0
"""Half of all commands so many times beyond a model's limits are in another unit."""

SIGN_CORRELATION = 0.8

RELATIONS = ("swapped", "position")
"""Kinds of finding that guess from the columns alone what they are: an axis whose model is followed is as it
is said to be, however slow its loop or short the record."""

MOST_PLACES = 1000
"""Where one record may begin in another, looked at at most."""


class SimulatedAxis(Protocol):
    """What is compared with records: a `HammersteinWiener`."""

    @property
    def sample_rate_hz(self) -> float: ...

    @property
    def units(self) -> Units: ...


def enter(
    records: Sequence[Record],
    holdout: Sequence[Record] = (),
    *,
    model: SimulatedAxis | None = None,
    origin: Origin = "start",
    start: Start = "auto",
    accepted: Collection[str] = (),
    looked_at: bool = False,
) -> Posed:
    """The records, found to be free of mistakes, as `posed` poses them, with warnings among the notes.

    Raises InputError, in one sentence with its remedy, where a record appears twice or is its own hold-out,
    or moves against its command where another moves with it; where rates or units of records or of the model
    differ; and where command and angle are swapped, of other units than stated, at a rate wrong by ten, or
    of opposite signs. What is `accepted`, by the kinds of `record_checks.Finding`, is not refused, nor are
    RELATIONS where the record follows the model; where the records were `looked_at`, their other findings are
    known. A scale that is doubted is told of the first record, since the others are of the same axis.
    """
    everything = (*records, *holdout)
    check_repeats(records, holdout)
    check_signs(everything)
    rates = [one.sample_rate_hz for one in (*everything, *(() if model is None else (model,)))]
    if max(rates, default=1.0) > (1 + RATE_TOLERANCE) * min(rates, default=1.0) and "scale" not in accepted:
        for record in everything:
            check_scale(record)
    for record in everything:
        _check_alike(record, everything[0].units, everything[0].sample_rate_hz, everything[0].name)
        if model is not None:
            _check_alike(record, model.units, model.sample_rate_hz, "the model", RATE_TOLERANCE)
    warnings: list[str] = []
    scales: list[str] = []
    for record in everything:
        told = None if model is None or "scale" in accepted else check_response(record, model)
        known = (*accepted, *(RELATIONS if told is not None and told.is_forward else ()))
        warnings += check_record(record, known, looked_at)
        if model is not None and looked_at:
            refuse_relation(record, known)
        if told is None and "scale" not in accepted:
            scales += check_scale(record)
    warnings += scales[:1]
    done = posed(records, holdout, origin=origin, start=start)
    return Posed(done.records, done.holdout, done.start, (*warnings, *done.notes))


def check_repeats(records: Sequence[Record], holdout: Sequence[Record] = ()) -> None:
    """Raise InputError where a record is there twice, or a record held out is one, or a part of one, that is
    estimated from."""
    for first, second in combinations(records, 2):
        if share_samples(first, second):
            raise InputError(
                f"{_place(second)}: holds the samples of {_place(first)} again; leave one out: counted twice "
                "they make every interval too narrow"
            )
    for held in holdout:
        for record in records:
            if share_samples(held, record):
                raise InputError(
                    f"{_place(held)}: is held out but its samples are in {_place(record)}, which the model "
                    "is fitted to; hold out another record, or split one"
                )


def check_signs(records: Sequence[Record]) -> None:
    """Raise InputError where one record moves with its command and another against it."""
    ways = {
        relation(record.u, record.y, record.sample_rate_hz): record
        for record in records
        if record.has_output and not record.measures_speed
    }
    if {"follows", "inverted"} <= set(ways):
        raise InputError(
            f"{_place(ways['inverted'])}: moves against its command, and {_place(ways['follows'])} with it: "
            "the sign of the angle or of the command is inverted in one of them; turn it with bayes-hw "
            "convert --reverse"
        )


def check_record(record: Record, accepted: Collection[str] = (), looked_at: bool = False) -> list[str]:
    """What a record's numbers warn of, in words; raises InputError at what would be fitted to nonsense.

    `accepted` and `looked_at` as for `enter`.
    """
    if not record.has_output or record.measures_speed:
        return []
    warnings = []
    for finding in () if looked_at else record.findings():
        if finding.severity == "fatal" and finding.kind not in accepted:
            raise InputError(f"{_place(record)}: {finding}")
        warnings.append(f"{_place(record)}: {finding}")
    return warnings


def refuse_relation(record: Record, accepted: Collection[str]) -> None:
    """Raise InputError where command and angle are to each other what their names deny, unless it is
    accepted."""
    for finding in record.findings():
        if finding.kind in RELATIONS and finding.kind not in accepted:
            raise InputError(f"{_place(record)}: {finding}; if it is so, give --accept {finding.kind}")


def check_whole(record: Record, accepted: Collection[str] = ()) -> list[str]:
    """What a record alone warns of, its scale as well, in words; raises InputError at what would be fitted to
    nonsense and is not `accepted`."""
    warnings = check_record(record, accepted)
    return warnings if "scale" in accepted else [*warnings, *check_scale(record)]


def check_scale(record: Record) -> list[str]:
    """What a record's speed warns of, in words; raises InputError where it tells of another unit or rate than
    stated."""
    found = scale_finding(record)
    if found is None:
        return []
    if found.severity == "fatal":
        raise InputError(f"{_place(record)}: {found}")
    return [f"{_place(record)}: {found}"]


def scale_finding(record: Record) -> Finding | None:
    """A speed that tells of another unit or of another sample rate than stated; None where nothing does."""
    if not record.has_output or record.measures_speed:
        return None
    expected = speed_of(record.units.output, record.units.input)
    units = (spelt(record.units.input), spelt(record.units.output))
    return wrong_scale(record.u, record.y, record.sample_rate_hz, expected, record.clock, units)


def check_response(record: Record, model: SimulatedAxis) -> Following | None:
    """How the record follows the model's simulation, None where that does not tell how fast it should move.

    Raises InputError where it moves against that, or faster or slower by a factor that a mistake explains.
    """
    simulate = getattr(model, "simulate", None)
    if simulate is None or not record.has_output:
        return None
    with np.errstate(all="ignore"):
        expected = np.asarray(simulate(record.u).w)
    if not np.isfinite(expected).all():
        return None
    _check_within_limits(record, model)
    found = speeds_compared(expected, record.y, record.sample_rate_hz)
    if found is None or not found.is_clear:
        return None
    if found.is_opposed and found.correlation > SIGN_CORRELATION:
        raise InputError(
            f"{_place(record)}: moves against what the model says of its command (correlation of the speeds "
            f"{found.signed:.2f}): the sign of the angle or of the command is inverted; turn one of them"
        )
    units = (spelt(record.units.input), spelt(record.units.output))
    guesses = mistakes_of(found.gain, record.sample_rate_hz, record.clock, units)
    if guesses:
        raise InputError(
            f"{_place(record)}: moves {found.gain:.3g} times as fast as the model says of its command: "
            f"{guesses}"
        )
    return found


def _check_within_limits(record: Record, model: SimulatedAxis) -> None:
    """Raise InputError where the usual command is many times what the model's axis takes at most."""
    limits = getattr(model, "saturation", None)
    moving = np.abs(record.u[record.u != 0])
    if limits is None or not len(moving):
        return
    usual, largest = float(np.median(moving)), max(abs(limits.lower), abs(limits.upper))
    if usual > FAR_BEYOND * largest:
        unit = record.units.input
        raise InputError(
            f"{_place(record)}: its usual command of {usual:.3g} {unit} is {usual / largest:.3g} times the "
            f"model's largest, {largest:.3g} {unit}: it is in another unit, say in which with --input-unit"
        )


def speeds_compared(expected: FloatArray, angle: FloatArray, rate_hz: float) -> Following | None:
    """How one angle's speed follows another's, as `bayes_hw.following.following`."""
    return following(np.gradient(expected) * rate_hz, angle, rate_hz)


def _check_alike(record: Record, units: Units, rate_hz: float, name: str, tolerance: float = 1e-6) -> None:
    """Raise InputError where units or rate of a record are not those of `name`."""
    for role, own, other in (
        ("input", record.units.input, units.input),
        ("output", record.units.output, units.output),
    ):
        if spelt(own) != spelt(other):
            raise InputError(
                f"{_place(record)}: its {role} is in {own}, that of {name} in {other}; convert the record, "
                f"or correct what is said of it with --{role}-unit"
            )
    check_rate(record, rate_hz, name, tolerance)


def has_rate(record: Record, rate_hz: float, tolerance: float = RATE_TOLERANCE) -> bool:
    """Whether a record is sampled at `rate_hz`."""
    return abs(record.sample_rate_hz / rate_hz - 1) <= tolerance


def check_rate(record: Record, rate_hz: float, name: str, tolerance: float = RATE_TOLERANCE) -> None:
    """Raise InputError where a record is sampled at another rate than `name` is for."""
    if not has_rate(record, rate_hz, tolerance):
        raise InputError(
            f"{_place(record)}: sampled at {record.sample_rate_hz:g} Hz but {name} is for {rate_hz:g} Hz; "
            f"resample with --resample {rate_hz:g}"
        )


def share_samples(first: Record, second: Record) -> bool:
    """Whether one of them is the other, or a stretch of it."""
    return _is_within(first, second) or _is_within(second, first)


def _is_within(part: Record, whole: Record) -> bool:
    """Whether all of a record's commands and angles are a stretch of another's."""
    length = len(part)
    if length > len(whole) or not part.has_output:
        return False
    places = np.flatnonzero(
        (whole.u[: len(whole) - length + 1] == part.u[0])
        & (whole.y[: len(whole) - length + 1] == part.y[0])
        & (whole.y[length - 1 :] == part.y[-1])
    )
    return any(
        np.array_equal(part.y, whole.y[place : place + length])
        and np.array_equal(part.u, whole.u[place : place + length])
        for place in places[:MOST_PLACES]
    )


def _place(record: Record) -> str:
    return record.source or record.name
