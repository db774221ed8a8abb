"""What is wrong with one record, found from its numbers before any model is fitted, each with its remedy.

Every check is a pure function of arrays that returns a `Finding` or None; `check_signals` runs those that
need command and output together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray, IntArray, stretches_of
from bayes_hw.following import following, relation
from bayes_hw.integral_regression import IntegralRegression, integral_regression, level_regression

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


def turn_of(y: FloatArray) -> float | None:
    """The turn at which an angle wraps; None where it does not."""
    found = _wrap(y)
    return None if found is None else found[0]


def wrapped_angle(y: FloatArray) -> Finding | None:
    """An angle that jumps by a whole turn, and what turn."""
    found = _wrap(y)
    if found is None:
        return None
    turn, is_jump = found
    first = int(np.flatnonzero(is_jump)[0]) + 1
    times = int(is_jump.sum())
    often = "" if times == 1 else f" ({times} such jumps)"
    return Finding(
        "wrapped",
        f"the angle jumps from {y[first - 1]:.6g} to {y[first]:.6g}{often}: it wraps at {TURNS[turn]}",
        f"give --unwrap {_turn_text(turn)}",
        first=first,
        stop=first + 1,
    )


def _wrap(y: FloatArray) -> tuple[float, BoolArray] | None:
    """The turn at which an angle wraps, and which of its steps are such jumps."""
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
    for turn in TURNS:
        if abs(jump - turn) <= TURN_TOLERANCE * turn + ordinary and extent <= 1.01 * turn + ordinary:
            return turn, is_jump
    return None


def _turn_text(turn: float) -> str:
    return f"{turn:.15g}"


def related(u: FloatArray, y: FloatArray, rate_hz: float) -> Finding | None:
    """What is wrong where the output does not move as behind a velocity command of its own sign."""
    found = relation(u, y, rate_hz)
    if found == "follows":
        return None
    moved = integral_regression(u, y, rate_hz)
    if found == "swapped" and _is_closer(integral_regression(y, u, rate_hz), moved):
        return Finding(
            "swapped",
            "the command moves as the speed of an angle does, and the output as the command of that speed: "
            "the two are swapped",
            "exchange --input and --output",
        )
    if found == "derivative" and _is_closer(level_regression(u, y), moved):
        return Finding(
            "position",
            "the output moves as the command itself does and not as its sum: the command is a position, or "
            "the output is a speed",
            "give --input-position NAME instead of --input NAME, or the speed's unit, such as --output-unit "
            "'deg/s'",
        )
    if found == "inverted" and moved.correlation < 0:
        return Finding(
            "inverted",
            "the output moves against the command: its sign is inverted",
            "give --reverse to count it the other way, or leave it out where it is given",
            "warning",
        )
    return None if moved.is_moved else unrelated(u, y, rate_hz)


def _is_closer(one: IntegralRegression, other: IntegralRegression) -> bool:
    return abs(one.correlation) > abs(other.correlation)


def stuck_output(u: FloatArray, y: FloatArray, rate_hz: float, expected: float) -> Finding | None:
    """An output that stays at one reading while the command goes on as it does where the output moves.

    `expected` as in `wrong_scale`. Either an encoder that reads something new at nearly every other sample
    stays while the command moves, or the angle has moved on by more than three of its steps when it shows
    again: rest, a dead zone and coarse readings are none, nor is a largest or smallest reading that it leaves
    as it moves.
    """
    first, stop = _longest_run(y)
    if (stop - first) / rate_hz < STUCK_SECONDS or stop - first < STUCK_SHARE * len(y):
        return None
    steps = np.diff(y)
    elsewhere = np.concatenate([steps[: max(first - 1, 0)], steps[stop:]])
    jump = abs(float(y[stop] - y[stop - 1])) if stop < len(y) else 0.0
    comes_back = 0 < jump <= float(np.abs(elsewhere).max(initial=0.0))
    again = int(np.sum(y == y[first])) > 1.2 * (stop - first)
    is_limit = y[first] in (y.max(), y.min()) and (again or comes_back)
    if len(elsewhere) < len(y) // 4 or is_limit:
        return None
    moves = float(np.std(u[first:stop])) > STUCK_COMMAND * float(np.std(u)) > 0
    always_moving = float(np.mean(elsewhere == 0)) < STUCK_REPEATS and y[first] != 0
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
    ends = flat_ends(y)
    if not ends:
        return None
    limit, starts, stops = ends[0]
    word = "largest" if limit == y.max() else "smallest"
    return Finding(
        "clipped",
        f"{int((stops - starts).sum())} samples read exactly {limit:.6g}, the {word} of all, in "
        f"{_times(len(starts))} of {CLIPPED_RUN} samples or more: the converter or the sensor is at its end",
        "give --missing ends to leave them out as not measured, or record with a wider range",
        "warning",
        first=int(starts[0]),
        stop=int(stops[0]),
    )


def flat_ends(y: FloatArray) -> list[tuple[float, IntArray, IntArray]]:
    """Largest and smallest reading where an output is cut flat there, with the first samples of such
    stretches and one past their last."""
    found = []
    if len(np.unique(y[:4096])) >= 64:
        for limit in (float(np.nanmax(y)), float(np.nanmin(y))):
            starts, stops = flat_stretches(y, limit)
            inner = (starts > 0) & (stops < len(y))
            if inner.any() and _is_cut(y, starts[inner], stops[inner], limit):
                found.append((limit, starts, stops))
    return found


def flat_stretches(y: FloatArray, limit: float) -> tuple[IntArray, IntArray]:
    """First samples of the stretches of one reading, and one past their last."""
    starts, stops = stretches_of(y == limit)
    runs = stops - starts >= CLIPPED_RUN
    return starts[runs], stops[runs]


def _times(count: int) -> str:
    return "one stretch" if count == 1 else f"{count} stretches"


def _is_cut(y: FloatArray, starts: IntArray, stops: IntArray, limit: float) -> bool:
    """Whether the readings around the flat stretches come in and go out with a slope, and readings elsewhere
    never repeat as often."""
    ordinary = np.diff(y[y != limit])
    if len(ordinary) == 0 or float(np.mean(ordinary == 0)) > 0.2:
        return False
    typical = float(np.median(np.abs(ordinary)))
    entry = np.abs(y[np.maximum(starts - 2, 0)] - limit)
    leave = np.abs(y[np.minimum(stops + 1, len(y) - 1)] - limit)
    return bool(np.any(np.maximum(entry, leave) > 0.5 * typical))


def _longest_run(y: FloatArray) -> tuple[int, int]:
    """First sample and one past the last of the longest stretch of equal values."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(y) != 0, [True]]))
    lengths = np.diff(edges)
    at = int(lengths.argmax())
    return int(edges[at]), int(edges[at + 1])


def unrelated(u: FloatArray, y: FloatArray, rate_hz: float) -> Finding | None:
    """An output that has nothing of the command, nor its speed anywhere, as where the drive was off."""
    forward = following(u, y, rate_hz)
    if forward is None or len(u) < FEWEST_TO_TELL or forward.gain > 0:
        return None
    if integral_regression(u, y, rate_hz).is_moved or level_regression(u, y).is_moved:
        return None
    return Finding(
        "unrelated",
        f"the output, which moves by {np.ptp(y):.3g} in all, does not follow the command (coherence of speed "
        f"and command {forward.correlation**2:.2f} at best)",
        "was the drive on, and are --input and --output the columns that they should be? If it is so, give "
        "--accept unrelated",
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
                "give --gaps bridge to take the hour out, or stamps in UTC",
                first=first,
                stop=first + 1,
            )
    return None


def check_signals(
    u: FloatArray,
    y: FloatArray,
    rate_hz: float,
    expected: float | None = None,
    measured: BoolArray | None = None,
) -> tuple[Finding, ...]:
    """Every finding on one record, its scale apart, the gravest first; `u`, `y` have shape (samples,).

    `expected` as in `wrong_scale`; where y was not `measured`, it stays where it was in between, which is no
    fault.
    """
    wrapped = wrapped_angle(y)
    if wrapped is not None:
        return (wrapped,)
    relation_found = related(u, y, rate_hz)
    if relation_found is not None and relation_found.severity == "fatal":
        return (relation_found,)
    stuck = stuck_output(u, y, rate_hz, expected or 1.0)
    if stuck is not None and measured is not None and np.mean(measured[stuck.first : stuck.stop]) < 0.5:
        stuck = None
    found = (
        stuck,
        relation_found,
        saturated_output(y),
    )
    return tuple(finding for finding in found if finding is not None)
