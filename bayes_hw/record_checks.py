"""What is wrong with one record, found from its numbers before any model is fitted, each with its remedy.

Every check is a pure function of arrays that returns a `Finding` or None; `check_signals` runs those that
need command and output together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.following import following, relation

TURNS = {
    360.0: "360 deg",
    2 * math.pi: "2 pi rad",
    24.0: "24 h",
    400.0: "400 gon",
    21_600.0: "21600 arcmin",
    1_296_000.0: "1296000 arcsec",
    2 * math.pi * 1000: "2000 pi mrad",
} | {float(2**bits): f"2^{bits} counts" for bits in range(10, 33)}
"""Whole turns at which angles wrap, in the units that instruments count in."""

TURN_TOLERANCE = 0.02
"""Largest difference of a jump from a whole turn, relative to the turn, beside what the axis moves."""

WRAP_FACTOR = 8.0
"""A jump is this many times the largest of the ordinary steps, or it is none."""

PLAIN_RATIOS = (1 / 9, 3.0)
"""Output speed over command, in one unit, that needs no explanation."""

LEAST_GAIN = 1 / 18
"""From which a smaller ratio than PLAIN_RATIOS is doubted, not refused, unless a mistake explains it to
NEARLY: an axis may have such a gain."""

NEARLY = 0.12

TRUE_RATIOS = (0.16, 1.4)
"""And that axes which lag, slip or saturate show."""

MOST_GUESSES = 3
ALIKE = 0.3
"""Mistakes within so much of each other, as a logarithm, stand in the order of the list."""

OUTDONE = 1.0
"""A mistake that explains the ratio worse than the best by so much, as a logarithm, is not offered."""


class UnitMistake(NamedTuple):
    """A mistake by which the output seems to move `factor` times as fast as the command says."""

    factor: float
    said: str


RADIAN = 180 / math.pi

MISTAKES = (
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


STUCK_SHARE = 0.02
STUCK_SECONDS = 2.0
STUCK_REPEATS = 0.05
STUCK_COMMAND = 0.1
CLIPPED_RUN = 5

FEWEST_TO_TELL = 1000

HOUR_S = 3600.0


@dataclass(frozen=True)
class Finding:
    """One fault of a record.

    `kind` is a name for programs, `sentence` says what was seen and where, `remedy` what to do, with the
    option of the command line that does it. A `fatal` fault would be fitted to nonsense.
    `first`, `stop` are the samples that show it.
    """

    kind: str
    sentence: str
    remedy: str
    severity: Literal["fatal", "warning"] = "fatal"
    first: int = 0
    stop: int = 0

    def __str__(self) -> str:
        return f"{self.sentence}; {self.remedy}"


def wrapped_angle(y: FloatArray) -> Finding | None:
    """An angle that jumps by a whole turn, and what turn."""
    steps = np.diff(y)
    if len(steps) < 3:
        return None
    sizes = np.abs(steps)
    extent = float(np.ptp(y))
    at = int(sizes.argmax())
    jump = float(sizes[at])
    is_jump = sizes > 0.5 * jump
    ordinary = float(sizes[~is_jump].max()) if not is_jump.all() else 0.0
    if ordinary == 0 or jump < WRAP_FACTOR * ordinary or jump < 0.5 * extent:
        return None
    for turn, said in TURNS.items():
        if abs(jump - turn) <= TURN_TOLERANCE * turn + ordinary and extent <= 1.01 * turn + ordinary:
            first = int(np.flatnonzero(is_jump)[0]) + 1
            times = int(is_jump.sum())
            often = "" if times == 1 else f" ({times} such jumps)"
            return Finding(
                "wrapped",
                f"the angle jumps from {y[first - 1]:.6g} to {y[first]:.6g}{often}: it wraps at {said}",
                f"give --unwrap {_turn_text(turn)}",
                first=first,
                stop=first + 1,
            )
    return None


def _turn_text(turn: float) -> str:
    return f"{turn:.15g}"


def related(u: FloatArray, y: FloatArray, rate_hz: float) -> Finding | None:
    """What is wrong where the output does not move as behind a velocity command of its own sign."""
    found = relation(u, y, rate_hz)
    if found == "swapped":
        return Finding(
            "swapped",
            "the command moves as the speed of an angle does, and the output as the command of that speed: "
            "the two are swapped",
            "exchange --input and --output",
        )
    if found == "derivative":
        return Finding(
            "position",
            "the output moves as the command itself does and not as its sum: the command is a position, or "
            "the output is a speed",
            "give --input-position NAME instead of --input NAME, or the speed's unit, such as --output-unit "
            "'deg/s'",
        )
    if found == "inverted":
        return Finding(
            "inverted",
            "the output moves against the command: its sign is inverted",
            "give --reverse to count it the other way, or leave it out where it is given",
            "warning",
        )
    return unrelated(u, y, rate_hz)


def wrong_scale(
    u: FloatArray, y: FloatArray, rate_hz: float, expected: float | None, clock: str = "s"
) -> Finding | None:
    """Speed and command that differ by the factor of another unit or of another rate.

    `expected` is the speed, in the output's unit, of a command of one that the axis follows exactly; None
    where the units do not tell. `clock` as in `bayes_hw.record.Record`.
    """
    forward = following(u, y, rate_hz)
    if expected is None or forward is None or relation(u, y, rate_hz) not in ("follows", "inverted"):
        return None
    ratio = forward.gain / expected
    guesses = mistakes_of(ratio, rate_hz, clock)
    if not guesses:
        return _doubtful_rate(ratio, rate_hz) if clock == NO_CLOCK else None
    seconds = len(u) / rate_hz
    length = "" if BRIEF_S <= seconds <= LONG_S else f" in a record of {seconds:.3g} s"
    return Finding(
        "scale",
        f"the output moves {ratio:.3g} times as fast as the command says{length}: {guesses}",
        "give the option that is so, with --ignore-units where the file states a wrong unit; a command of "
        "the motor before its gear is said with --input-unit 'deg/s at the motor'",
        "warning" if _is_doubtful(ratio, rate_hz, clock) else "fatal",
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


def _is_doubtful(ratio: float, rate_hz: float, clock: str) -> bool:
    """Whether a speed `ratio` times what is expected may be the axis's own."""
    nearest = min(_missed(ratio, rate_hz, clock).values())
    return LEAST_GAIN <= ratio < PLAIN_RATIOS[0] and nearest > NEARLY


def mistakes_of(ratio: float, rate_hz: float, clock: str = "s") -> str:
    """What may make a speed `ratio` times what is expected, in words, the likeliest first; empty where it
    needs no explanation or none is known. `clock` as in `bayes_hw.record.Record`."""
    if PLAIN_RATIOS[0] <= ratio <= PLAIN_RATIOS[1]:
        return ""
    missed = _missed(ratio, rate_hz, clock)
    near = [mistake for mistake, by in missed.items() if by < min(missed.values()) + OUTDONE]
    near.sort(key=lambda mistake: round(missed[mistake] / ALIKE))
    return ", or ".join(mistake.said for mistake in near[:MOST_GUESSES])


def _missed(ratio: float, rate_hz: float, clock: str) -> dict[UnitMistake, float]:
    """Mistakes that leave the axis a true ratio, and how far that is from one, as a logarithm."""
    rates = tuple(
        UnitMistake(
            factor,
            f"its rate is rather {right:g} Hz than {rate_hz:g} Hz (--time none --sample-rate {right:g})",
        )
        for factor, right in ((10.0, rate_hz / 10), (0.1, 10 * rate_hz))
    )
    of_clock = _clock_mistakes(clock)
    ordered = (*MISTAKES, *of_clock) if clock == "s" else (*of_clock, *MISTAKES)
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


def stuck_output(u: FloatArray, y: FloatArray, rate_hz: float, expected: float) -> Finding | None:
    """An output that stays at one reading while the command goes on as it does where the output moves.

    `expected` as in `wrong_scale`. Either an encoder that reads something new at nearly every other sample
    stays while the command moves, or the angle has moved on by more than three of its steps when it shows
    again: rest, a dead zone and coarse readings are none.
    """
    first, stop = _longest_run(y)
    if (stop - first) / rate_hz < STUCK_SECONDS or stop - first < STUCK_SHARE * len(y):
        return None
    steps = np.diff(y)
    elsewhere = np.concatenate([steps[: max(first - 1, 0)], steps[stop:]])
    is_limit = y[first] in (y.max(), y.min()) and int(np.sum(y == y[first])) > 1.2 * (stop - first)
    if len(elsewhere) < len(y) // 4 or is_limit:
        return None
    moves = float(np.std(u[first:stop])) > STUCK_COMMAND * float(np.std(u)) > 0
    always_moving = float(np.mean(elsewhere == 0)) < STUCK_REPEATS and y[first] != 0
    jump = abs(float(y[stop] - y[stop - 1])) if stop < len(y) else 0.0
    if not (moves and always_moving) and not jump > 3 * float(np.abs(elsewhere).max()) > 0:
        return None
    travel = float(np.abs(u[first:stop]).sum()) / rate_hz * expected
    after = f", then jumps by {jump:.3g}" if stop < len(y) else ", the end of the record"
    start_s, stop_s, end_s = first / rate_hz, stop / rate_hz, len(y) / rate_hz
    part = (0.0, start_s) if start_s > end_s - stop_s else (stop_s, end_s)
    return Finding(
        "stuck",
        f"the output stays at {y[first]:.6g} for {stop_s - start_s:.3g} s from {start_s:.4g} s on{after}, "
        f"while the command goes on (to and fro by {travel:.3g} in all): the encoder is stuck",
        f"take a part without it, such as --part {part[0]:g} {part[1]:g} (s after the first sample)",
        first=first,
        stop=stop,
    )


def saturated_output(y: FloatArray) -> Finding | None:
    """An output that is cut flat at its largest or smallest reading, again and again."""
    if len(np.unique(y[:4096])) < 64:
        return None
    for limit, word in ((float(y.max()), "largest"), (float(y.min()), "smallest")):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], (y == limit).astype(np.int8), [0]])))
        starts, stops = edges[::2], edges[1::2]
        runs = stops - starts >= CLIPPED_RUN
        inner = runs & (starts > 0) & (stops < len(y))
        if int(inner.sum()) >= 1 and int(runs.sum()) >= 1 and _is_cut(y, starts[inner], stops[inner], limit):
            first = int(starts[inner][0])
            count = int((stops - starts)[runs].sum())
            return Finding(
                "clipped",
                f"{count} samples read exactly {limit:.6g}, the {word} of all, in {_times(int(runs.sum()))} "
                f"of {CLIPPED_RUN} samples or more: the converter or the sensor is at its end",
                "leave those stretches out with --part START STOP (s), or record with a wider range",
                "warning",
                first=first,
                stop=int(stops[inner][0]),
            )
    return None


def _times(count: int) -> str:
    return "one stretch" if count == 1 else f"{count} stretches"


def _is_cut(y: FloatArray, starts: IntArray, stops: IntArray, limit: float) -> bool:
    """Whether the readings around the flat stretches come in and go out with a slope, and readings elsewhere
    never repeat as often."""
    ordinary = np.diff(y[y != limit])
    if len(ordinary) == 0 or float(np.mean(ordinary == 0)) > 0.2:
        return False
    typical = float(np.median(np.abs(ordinary)))
    entry = np.abs(y[np.maximum(starts - 1, 0)] - limit)
    leave = np.abs(y[np.minimum(stops, len(y) - 1)] - limit)
    return bool(np.any(np.maximum(entry, leave) > 0.25 * typical))


def _longest_run(y: FloatArray) -> tuple[int, int]:
    """First sample and one past the last of the longest stretch of equal values."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(y) != 0, [True]]))
    lengths = np.diff(edges)
    at = int(lengths.argmax())
    return int(edges[at]), int(edges[at + 1])


def unrelated(u: FloatArray, y: FloatArray, rate_hz: float) -> Finding | None:
    """An output that moves, and whose speed has nothing of the command at any frequency."""
    forward = following(u, y, rate_hz)
    if forward is None or len(u) < FEWEST_TO_TELL or forward.gain > 0:
        return None
    return Finding(
        "unrelated",
        f"the output does not follow the command (coherence of speed and command "
        f"{forward.correlation**2:.2f} at best)",
        "are --input and --output the columns that they should be, and was the drive on?",
        "warning",
    )


def clock_change(t: FloatArray) -> Finding | None:
    """Stamps that jump by an hour, as a clock that goes over to or from summer time does; t in s."""
    steps = np.diff(t)
    if len(steps) < 3:
        return None
    median = float(np.median(steps))
    for hour in (HOUR_S, -HOUR_S):
        at = np.flatnonzero(np.abs(steps - hour - median) <= max(2 * median, 1.0))
        if len(at) and 20 * median < HOUR_S:
            first = int(at[0]) + 1
            way = "forward" if hour > 0 else "back"
            return Finding(
                "clock_change",
                f"the clock jumps {way} by an hour: it went over to or from summer time",
                "give --gaps split to make two records of it, or stamps in UTC",
                first=first,
                stop=first + 1,
            )
    return None


def check_signals(
    u: FloatArray, y: FloatArray, rate_hz: float, expected: float | None = None
) -> tuple[Finding, ...]:
    """Every finding on one record, its scale apart, the gravest first; `u`, `y` have shape (samples,).

    `expected` as in `wrong_scale`.
    """
    wrapped = wrapped_angle(y)
    if wrapped is not None:
        return (wrapped,)
    relation_found = related(u, y, rate_hz)
    if relation_found is not None and relation_found.severity == "fatal":
        return (relation_found,)
    found = (
        stuck_output(u, y, rate_hz, expected or 1.0),
        relation_found,
        saturated_output(y),
    )
    return tuple(finding for finding in found if finding is not None)
