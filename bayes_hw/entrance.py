"""What every command and every function does with records first: look for mistakes, then pose them.

One check for the command line and for Python, before anything is fitted.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from itertools import combinations
from typing import Protocol

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.posing import Origin, Posed, Start, posed
from bayes_hw.quantities import speed_of, spelt
from bayes_hw.record import Record, Units
from bayes_hw.record_checks import CLEAR, Finding, Following, following

RATE_TOLERANCE = 0.01
"""Largest relative difference of the sample rates of a model and a record."""

TOO_FAST, TOO_SLOW = (3.0, 11.0), (1 / 40, 1 / 9)
"""Output speed over command, in one unit, that tells of a rate ten times too high, and too low: axes that
lag, slip or saturate show 0.2 to 1.3."""

RADIANS = ((11.0, 75.0), (1 / 320, 1 / 42))
"""The same that tells of radians beside degrees."""

RADIAN = 180 / math.pi

FACTORS = (
    (RADIAN, "deg where the model has rad"),
    (1 / RADIAN, "rad where the model has deg"),
    (10.0, "sampled ten times slower than stated"),
    (0.1, "sampled ten times faster than stated"),
)
"""Ratios of measured to simulated speed that a mistake explains, and what the record then is."""

FACTOR_TOLERANCE = 0.3
"""Relative; a nominal gain is off by some 5 %, and what no model holds takes its share."""

SIGN_CORRELATION = -0.8

MOST_PLACES = 1000
"""Where one record may begin in another, looked at at most."""

SPEEDS = ("/s", "rpm", "/min", "/h")
"""How units of a speed end: an output in one has no origin to count from."""


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

    Raises InputError, in one sentence with its remedy, where a record appears twice or is its own hold-out;
    where rates or units of records or of the model differ; and where command and angle are swapped, of
    other units than stated, at a rate wrong by ten, or of opposite signs. What is `accepted`, by the kinds of
    `record_checks.Finding`, is not refused; where the records were `looked_at`, their findings are known.
    """
    everything = (*records, *holdout)
    check_repeats(records, holdout)
    for record in everything:
        _check_alike(record, everything[0].units, everything[0].sample_rate_hz, everything[0].name)
        if model is not None:
            _check_alike(record, model.units, model.sample_rate_hz, "the model", RATE_TOLERANCE)
    warnings: list[str] = []
    for record in everything:
        told = model is not None and "scale" not in accepted and check_response(record, model)
        warnings += check_record(record, {*accepted, "scale"} if told else accepted, looked_at)
    is_speed = any(_is_speed(record) for record in everything)
    done = posed(records, holdout, origin="absolute" if is_speed else origin, start=start)
    return Posed(done.records, done.holdout, done.start, (*warnings, *done.notes))


def check_repeats(records: Sequence[Record], holdout: Sequence[Record] = ()) -> None:
    """Raise InputError where a record is there twice, or a record held out is one, or a part of one, that is
    estimated from."""
    for first, second in combinations(records, 2):
        if _is_within(second, first) or _is_within(first, second):
            raise InputError(
                f"{_place(second)}: holds the samples of {_place(first)} again; leave one out: counted twice "
                "they make every interval too narrow"
            )
    for held in holdout:
        for record in records:
            if _is_within(held, record) or _is_within(record, held):
                raise InputError(
                    f"{_place(held)}: is held out but its samples are in {_place(record)}, which the model "
                    "is fitted to; hold out another record, or split one"
                )


def check_record(record: Record, accepted: Collection[str] = (), looked_at: bool = False) -> list[str]:
    """What a record's numbers warn of, in words; raises InputError at what would be fitted to nonsense.

    `accepted` and `looked_at` as for `enter`.
    """
    if not record.has_output or _is_speed(record):
        return []
    scale = None if "scale" in accepted else scale_finding(record)
    if scale is not None:
        raise InputError(f"{_place(record)}: {scale}")
    warnings = []
    for finding in () if looked_at else record.findings():
        if finding.severity == "fatal" and finding.kind not in accepted:
            raise InputError(f"{_place(record)}: {finding}")
        warnings.append(f"{_place(record)}: {finding}")
    found = None if looked_at or warnings else best_following(record)
    if found is not None and found.correlation < SIGN_CORRELATION:
        warnings.append(
            f"{_place(record)}: moves against its command (correlation of the speeds "
            f"{found.correlation:.2f}): is the sign of one of them inverted?"
        )
    return warnings


def _is_speed(record: Record) -> bool:
    return record.units.output.endswith(SPEEDS)


def best_following(record: Record) -> Following | None:
    """`record_checks.following` over stretches a tenth to ten times as long, speeds at the stated rate."""
    rate = record.sample_rate_hz
    found = [(following(record.u, record.y, each), each) for each in (rate, 10 * rate, rate / 10)]
    stated = [Following(one.correlation, one.slope * rate / each) for one, each in found if one is not None]
    return max(stated, key=lambda one: abs(one.correlation), default=None)


def scale_finding(record: Record) -> Finding | None:
    """A speed that tells of another unit or of another sample rate than stated; None where nothing does."""
    if not record.has_output or _is_speed(record):
        return None
    expected = speed_of(record.units.output, record.units.input)
    found = best_following(record)
    if expected is None or found is None or abs(found.correlation) < CLEAR:
        return None
    ratio, rate = abs(found.slope) / expected, record.sample_rate_hz
    fast = f"the output moves {ratio:.2g} times as fast as the command says"
    gear = (
        "where the command is that of a motor before its gear, say so with --input-unit 'deg/s at the motor'"
    )
    if any(low <= ratio <= high for low, high in RADIANS):
        return Finding(
            "scale",
            f"{fast}: one of the two is in radians and the other in degrees",
            f"give --output-unit or --input-unit, or, {gear}",
        )
    for (low, high), right in ((TOO_FAST, rate / 10), (TOO_SLOW, 10 * rate)):
        if low <= ratio <= high:
            return Finding(
                "scale",
                f"{fast}: its rate is rather {right:g} Hz than {rate:g} Hz",
                f"correct the time stamps or give --time none --sample-rate {right:g}, or, {gear}",
            )
    return None


def check_response(record: Record, model: SimulatedAxis) -> bool:
    """Whether the model's simulation tells how fast the record should move.

    Raises InputError where it moves against that, or faster or slower by a factor that a mistake explains.
    """
    simulate = getattr(model, "simulate", None)
    if simulate is None or not record.has_output:
        return False
    with np.errstate(all="ignore"):
        expected = np.asarray(simulate(record.u).w)
    if not np.isfinite(expected).all():
        return False
    found = speeds_compared(expected, record.y, record.sample_rate_hz)
    if found is None or abs(found.correlation) < CLEAR:
        return False
    if found.correlation < SIGN_CORRELATION:
        raise InputError(
            f"{_place(record)}: moves against what the model says of its command (correlation of the speeds "
            f"{found.correlation:.2f}): the sign of the angle or of the command is inverted; turn one of them"
        )
    ratio = abs(found.slope)
    for factor, meaning in FACTORS:
        if abs(math.log(ratio / factor)) < FACTOR_TOLERANCE:
            raise InputError(
                f"{_place(record)}: moves {ratio:.3g} times as fast as the model says of its command: it is "
                f"{meaning}; correct its units or its rate"
            )
    return True


def speeds_compared(expected: FloatArray, angle: FloatArray, rate_hz: float) -> Following | None:
    """Correlation and slope of two angles' speeds; as `record_checks.following`, the model in the command's
    place."""
    speed = np.gradient(expected) * rate_hz
    return following(speed, angle, rate_hz)


def _check_alike(record: Record, units: Units, rate_hz: float, name: str, tolerance: float = 1e-6) -> None:
    for role, own, other in (
        ("input", record.units.input, units.input),
        ("output", record.units.output, units.output),
    ):
        if spelt(own) != spelt(other):
            raise InputError(
                f"{_place(record)}: its {role} is in {own}, that of {name} in {other}; convert the record, "
                f"or correct what is said of it with --{role}-unit"
            )
    if abs(record.sample_rate_hz / rate_hz - 1) > tolerance:
        raise InputError(
            f"{_place(record)}: sampled at {record.sample_rate_hz:g} Hz but {name} is for {rate_hz:g} Hz; "
            f"resample with --resample {rate_hz:g}"
        )


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
