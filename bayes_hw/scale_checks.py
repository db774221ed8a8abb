"""What is wrong with the scale of one record: units, clock or rate by which its output seems to move faster
or slower than its command says."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import NamedTuple

from bayes_hw.arrays import FloatArray
from bayes_hw.following import following, relation
from bayes_hw.integral_regression import integral_regression
from bayes_hw.record_checks import Finding

PLAIN_RATIOS = (1 / 9, 3.0)
"""Output speed over command, in one unit, that needs no explanation."""

LEAST_GAIN = 1 / 18
"""From which a smaller ratio than PLAIN_RATIOS is doubted, not refused, unless a mistake explains it to
NEARLY, the speeds at low frequencies and the whole way alike: an axis may have such a gain."""

NEARLY = 0.04

TRUE_RATIOS = (0.16, 1.4)
"""And that axes which lag, slip or saturate show."""

MOST_GUESSES = 3
ALIKE = 0.3
"""Mistakes within so much of each other, as a logarithm, stand in the order of the list."""

OUTDONE = 1.0
"""A mistake that explains the ratio worse than the best by so much, as a logarithm, is not offered."""


class UnitMistake(NamedTuple):
    """A mistake by which the output seems to move `factor` times as fast as the command says; where
    `instead_of` is a unit, only where a column is said to be in it."""

    factor: float
    said: str
    instead_of: str = ""


RADIAN = 180 / math.pi

MISTAKES = (
    UnitMistake(RADIAN, "the angle is in degrees, not in rad (--output-unit deg --ignore-units)", "rad"),
    UnitMistake(
        1 / RADIAN, "the command is in degrees, not in rad (--input-unit 'deg/s' --ignore-units)", "rad/s"
    ),
    UnitMistake(RADIAN, "the command is in radians and the angle in degrees (--input-unit 'rad/s')"),
    UnitMistake(1 / RADIAN, "the angle is in radians and the command in degrees (--output-unit 'rad')"),
    UnitMistake(1 / 60, "the command is in minutes of arc (--input-unit 'arcmin/s')"),
    UnitMistake(6.0, "the command is in revolutions per minute (--input-unit 'rpm')"),
    UnitMistake(360.0, "the command is in revolutions per second (--input-unit 'rev/s')"),
    UnitMistake(1 / 360, "the angle is in revolutions (--output-unit 'rev')"),
    UnitMistake(3600.0, "the angle is in seconds of arc (--output-unit 'arcsec')"),
    UnitMistake(1 / 3600, "the command is in seconds of arc (--input-unit 'arcsec/s')"),
    UnitMistake(1000.0, "the angle is in thousandths (--output-unit 'mdeg')"),
)

NO_CLOCK = "none"
"""The clock of a record whose rate was stated and not recorded."""

CLOCKS = {"min": (60.0, "minutes"), "h": (3600.0, "hours"), "s": (1.0, "s"), "ms": (1e-3, "ms")} | {
    "us": (1e-6, "us"),
    "ns": (1e-9, "ns"),
}
"""Seconds in what a clock may count, and its name."""

SURE_RATIOS = (0.7, 1.35)
"""Output speed over command beyond which a rate that was stated and not recorded is doubted."""

BRIEF_S, LONG_S = 2.0, 86_400.0
"""Records that are shorter or longer are told by how long they are."""


def wrong_scale(
    u: FloatArray,
    y: FloatArray,
    rate_hz: float,
    expected: float | None,
    clock: str = "s",
    units: Collection[str] = (),
) -> Finding | None:
    """Speed and command that differ by the factor of another unit or of another rate.

    `expected` is the speed, in the output's unit, of a command of one that the axis follows exactly; None
    where the units do not tell. `clock` as in `bayes_hw.record.Record`; `units` what the columns are said to
    be in.
    """
    forward = following(u, y, rate_hz)
    if expected is None or forward is None or relation(u, y, rate_hz) not in ("follows", "inverted"):
        return None
    ratio = forward.gain / expected
    guesses = mistakes_of(ratio, rate_hz, clock, units)
    overall = abs(integral_regression(u, y, rate_hz).gain) / expected if guesses else ratio
    if not guesses or not mistakes_of(overall, rate_hz):
        return _doubtful_rate(ratio, rate_hz) if clock == NO_CLOCK else _too_fast(ratio, rate_hz)
    seconds = len(u) / rate_hz
    length = "" if BRIEF_S <= seconds <= LONG_S else f" in a record of {seconds:.3g} s"
    doubtful = any(_is_doubtful(one, rate_hz, clock, units) for one in (ratio, overall))
    own = "that is the gain of the axis, or " if doubtful else ""
    return Finding(
        "scale",
        f"the output moves {ratio:.3g} times as fast as the command says{length}: {own}{guesses}",
        "give the option that is so, with --ignore-units where the file states a wrong unit; a command of "
        "the motor before its gear is said with --input-unit 'deg/s at the motor'",
        "warning" if doubtful else "fatal",
    )


def _doubtful_rate(ratio: float, rate_hz: float) -> Finding | None:
    """Where nothing recorded the rate, a speed that the command does not explain is as well that of a wrong
    one; an axis may have such a gain, too."""
    if SURE_RATIOS[0] <= ratio <= SURE_RATIOS[1]:
        return None
    return Finding(
        "rate",
        f"the rate of {rate_hz:g} Hz was stated and not recorded, and with it the output moves {ratio:.2g} "
        "times as fast as the command says",
        f"is it rather about {rate_hz / ratio:.3g} Hz (--sample-rate), or is that the gain of the axis?",
        "warning",
    )


def _too_fast(ratio: float, rate_hz: float) -> Finding | None:
    """Limits, slip and lag make an axis slower than its command, nothing but its gain makes it faster."""
    if ratio <= SURE_RATIOS[1]:
        return None
    return Finding(
        "rate",
        f"the output moves {ratio:.2g} times as fast as the command says",
        f"is its rate, {rate_hz:g} Hz by its stamps, rather about {rate_hz / ratio:.3g} Hz (--time none "
        "--sample-rate), is a unit wrong, or is that the gain of the axis?",
        "warning",
    )


def _is_doubtful(ratio: float, rate_hz: float, clock: str, units: Collection[str]) -> bool:
    """Whether a speed `ratio` times what is expected may be the axis's own."""
    nearest = min(_missed(ratio, rate_hz, clock, units).values(), default=math.inf)
    return LEAST_GAIN <= ratio < PLAIN_RATIOS[0] and nearest > NEARLY


def mistakes_of(ratio: float, rate_hz: float, clock: str = "s", units: Collection[str] = ()) -> str:
    """What may make a speed `ratio` times what is expected, in words, the likeliest first; empty where it
    needs no explanation or none is known. `clock` and `units` as in `wrong_scale`."""
    if PLAIN_RATIOS[0] <= ratio <= PLAIN_RATIOS[1]:
        return ""
    missed = _missed(ratio, rate_hz, clock, units)
    near = [mistake for mistake, by in missed.items() if by < min(missed.values()) + OUTDONE]
    near.sort(key=lambda mistake: round(missed[mistake] / ALIKE))
    return ", or ".join(mistake.said for mistake in near[:MOST_GUESSES])


def _missed(ratio: float, rate_hz: float, clock: str, units: Collection[str]) -> dict[UnitMistake, float]:
    """Mistakes that leave the axis a true ratio, and how far that is from one, as a logarithm."""
    rates = tuple(
        UnitMistake(
            factor,
            f"its rate is rather {right:g} Hz than {rate_hz:g} Hz (--time none --sample-rate {right:g})",
        )
        for factor, right in ((10.0, rate_hz / 10), (0.1, 10 * rate_hz))
    )
    of_clock = _clock_mistakes(clock)
    of_unit = [one for one in MISTAKES if not one.instead_of or one.instead_of in units]
    ordered = (*of_unit, *of_clock) if clock == "s" else (*of_clock, *of_unit)
    return {
        mistake: abs(math.log(ratio / mistake.factor))
        for mistake in (*ordered, *rates)
        if TRUE_RATIOS[0] <= ratio / mistake.factor <= TRUE_RATIOS[1]
    }


def _clock_mistakes(clock: str) -> list[UnitMistake]:
    """The other units that a clock may count, where it was taken to count one and does not say it itself."""
    taken = CLOCKS.get(clock)
    if taken is None:
        return []
    return [
        UnitMistake(seconds / taken[0], f"the clock counts in {word} (--time-unit {unit})")
        for unit, (seconds, word) in CLOCKS.items()
        if unit != clock
    ]
