"""What the records can identify, what they cannot, and what to record next, in words."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import stretches_of
from bayes_hw.first_look.measures import Measures
from bayes_hw.first_look.response import MeasuredResponse
from bayes_hw.first_look.ripple import Ripple
from bayes_hw.following import following
from bayes_hw.phrases import listed, plainly
from bayes_hw.quantities import speed_of
from bayes_hw.record import Record

COHERENT = 0.8
SHORT_S = 120.0
TRIANGLES = "Slow triangles at two speeds, ten reversals each, for dead zone, play and friction."
FEW = 4
FEW_REVERSALS = 6


@dataclass(frozen=True)
class Advice:
    """Sentences: `sentence` sums up, the others list what is shown, what is not, and what to record next."""

    sentence: str
    shows: tuple[str, ...]
    cannot_show: tuple[str, ...]
    record_next: tuple[str, ...]

    def __str__(self) -> str:
        """A line each: the sum, what is shown, what is not, what to record next."""
        parts = (("shown", self.shows), ("not shown", self.cannot_show), ("record next", self.record_next))
        return "\n".join([self.sentence, *(f"{name}: {item}" for name, items in parts for item in items)])


def advice(measures: Measures) -> Advice:
    """From what was measured."""
    records, statics, response = measures.records, measures.apart, measures.response
    delay, feedback, reversals, at_limits = (
        measures.delay,
        measures.feedback,
        measures.reversals,
        measures.at_limits,
    )
    repeated = measures.repeated
    units = records[0].units
    shows, cannot, afterwards = [], [], []
    for name, limit, share in (
        ("lower", statics.lower, at_limits[0]),
        ("upper", statics.upper, at_limits[1]),
    ):
        if limit is None:
            cannot.append(f"The {name} limit of the command is not met: it may lie beyond this record.")
        else:
            shows.append(
                f"The {name} limit, about {plainly(limit, 2)} {units.input}: "
                f"{percent(share)} of the samples ask for more."
            )
    if statics.lower is None or statics.upper is None:
        afterwards.append("A sweep or steps whose command exceeds both limits, to both sides.")
    behind = repeated.hysteresis
    if statics.half_width is not None:
        half_width = f"{estimate(statics.half_width, statics.sd(2))} {units.output}"
        if behind is not None and (behind.is_clear or behind.bound < statics.half_width):
            shows.append(f"A dead zone of half width {half_width}.")
        else:
            shows.append(f"Dead zone or play or friction at reversals: half width {half_width}.")
            cannot.append(
                "Dead zone apart from play and friction: strokes of a second or more, at two speeds, show it."
            )
            afterwards.append(TRIANGLES)
    if behind is not None and repeated.shown_hysteresis is not None:
        shows.append(
            f"Hysteresis: by direction of motion the angle stays behind by {-behind.half_width:.2g} "
            f"{units.output} either way, as play or friction make it, in {behind.reversals} "
            "reversals between longer strokes."
        )
    elif statics.half_width is None and reversals < FEW_REVERSALS:
        cannot.append(f"Dead zone and play: the axis {reverses(reversals)}; some ten reversals show them.")
        afterwards.append(
            "Slow triangles: ten reversals about the starting angle, slower than a tenth of full speed."
        )
    elif statics.half_width is None and behind is None:
        cannot.append("Dead zone and play: strokes of a second or more, at two speeds, tell them from a lag.")
        afterwards.append(TRIANGLES)
    elif statics.half_width is None and behind is not None and statics.bound is not None:
        shows.append(
            f"No dead zone or hysteresis of half width above {max(statics.bound, behind.bound):.2g} "
            f"{units.output} (94 %), in {reversals} reversals."
        )
    shows += [_ripple(ripple, units.output, measures.turn) for ripple in repeated.ripples]
    shows += [
        f"What the angle owes to {column.name}: {percent(column.share)} of the error follows it, coherence "
        f"up to {column.coherence.max():.2f} at {column.strongest_hz:.2g} Hz."
        for column in measures.known
        if column.follows
    ]
    band = coherent_band(response)
    if band is None:
        cannot.append(
            "The frequency response: nowhere does the command explain four fifths of the output's rate."
        )
        afterwards.append("A sweep of larger amplitude, slow enough to give each resonance some ten cycles.")
    else:
        shows.append(
            f"The frequency response from {band[0]:.2g} to {band[1]:.2g} Hz (coherence above {COHERENT:g})"
            f"{_slow_motion(records)}."
        )
        if band[1] < 0.35 * records[0].sample_rate_hz / 2:
            cannot.append(
                f"Resonances above {band[1]:.2g} Hz: the command does not excite them above the noise."
            )
            afterwards.append(f"A sweep that goes beyond {band[1]:.2g} Hz at larger amplitude.")
    if delay is not None:
        if delay.is_close:
            shows.append(
                f"The delay, dead time and a slow start together: the axis is first seen to move "
                f"{delay.low:.3g} to {delay.high:.3g} s after its command."
            )
        else:
            cannot.append(
                f"The delay closer than {delay.low:.3g} to {delay.high:.3g} s: a slow start looks alike."
            )
            afterwards.append("Steps of the command, each held until the axis has settled, for the delay.")
    if feedback is not None and feedback.closed_loop:
        cannot.append(
            "Noise apart from the axis: the command follows past noise, a loop was closed around it."
        )
        afterwards.append("The same with the position loop open, or with the reference recorded as well.")
    duration = sum(record.duration_s for record in records)
    if duration < SHORT_S:
        afterwards.append(f"Longer records: {duration:.0f} s in all here, two minutes or more each.")
    if len(records) < 2:
        afterwards.append("The same command again, as a repeat, and one other kind of command to hold out.")
    if not all(_rests(record) for record in records):
        afterwards.append("A second or more of rest before and after each command.")
    return Advice(_sentence(shows, cannot, band), tuple(shows), tuple(cannot), tuple(afterwards))


def estimate(value: float, sd: float) -> str:
    """A value with twice its standard deviation, to the second digit of that."""
    decimals = max(0, 1 - math.floor(math.log10(2 * sd))) if sd > 0 else 3
    return f"{value:.{decimals}f} ± {2 * sd:.{decimals}f}" if sd > 0 else f"{value:.3g}"


def percent(share: float) -> str:
    """A share that is not zero is not written as zero."""
    return "less than 1 %" if 0 < share < 0.005 else f"{100 * share:.0f} %"


def coherent_band(response: MeasuredResponse | None) -> tuple[float, float] | None:
    """The widest run of frequencies, by their ratio, whose coherence is above COHERENT; None for a few."""
    if response is None:
        return None
    frequency, above = response.linear.frequency_hz, response.linear.coherence > COHERENT
    edges = zip(*stretches_of(above), strict=True)
    runs = [(float(frequency[a]), float(frequency[b - 1])) for a, b in edges if b - a >= FEW]
    return max(runs, key=lambda run: run[1] / run[0], default=None)


def _sentence(shows: list[str], cannot: list[str], band: tuple[float, float] | None) -> str:
    if band is None:
        return "These records tell little of the axis: the command does not stand out from the noise."
    if not cannot:
        return "These records are good to identify from: limits, dead zone, response and delay all show."
    lacking = f"lack {listed([short_name(item) for item in cannot])}"
    if not shows:
        return f"These records {lacking}."
    return f"These records show {listed([seen_name(item) for item in shows])}, and {lacking}."


def seen_name(item: str) -> str:
    """What a sentence of `Advice.shows` is about."""
    name = re.split(r"[:,]| from | of half width ", item, maxsplit=1)[0]
    return name[0].lower() + name[1:]


def short_name(item: str) -> str:
    """What a sentence of `Advice.cannot_show` is about."""
    name = item.partition(":")[0].partition(" is not met")[0].partition(" closer than")[0]
    return name[0].lower() + name[1:]


def reverses(count: int) -> str:
    """How often the axis does, in words for few."""
    if count == 0:
        return "never reverses"
    return "reverses " + {1: "once", 2: "twice"}.get(count, f"{count} times")


def _slow_motion(records: Sequence[Record]) -> str:
    """How fast the axis of the longest record moves beside a slow command; a rate that is wrong by less than
    what an axis's gain may be shows in nothing else."""
    longest = max(records, key=len)
    expected = speed_of(longest.units.output, longest.units.input)
    found = following(longest.u, longest.y, longest.sample_rate_hz)
    if expected is None or found is None or not found.is_clear:
        return ""
    return f": slow motion has {percent(found.gain / expected)} of the speed commanded"


def _ripple(ripple: Ripple, unit: str, turn: float | None) -> str:
    a_turn = "" if turn is None else f", {turn / ripple.period:.4g} to the turn"
    return (
        f"An error periodic in the angle: amplitude {ripple.amplitude:.2g} {unit}, period "
        f"{ripple.period:.3g} {unit}{a_turn}, over {ripple.visits} passages: cogging, gear mesh or the "
        "encoder."
    )


def _rests(record: Record) -> bool:
    count = max(2, round(0.5 * record.sample_rate_hz))
    quiet = 0.01 * float(np.abs(record.u).max())
    return bool((np.abs(record.u[:count]) <= quiet).all() and (np.abs(record.u[-count:]) <= quiet).all())
