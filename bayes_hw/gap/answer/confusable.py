"""The experiment that would tell apart what the records leave open."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

SHOWS: Mapping[str, str] = MappingProxyType(
    {
        "rate_limit": "steps of the command of two sizes: a ramp's length grows with the step",
        "saturation_drift": "the same saturating step from several positions of the axis",
        "command_bias": "some motion, then a minute of zero command: a bias moves the axis on",
        "gain_drift": "the same command at the start and an hour later, drives warm",
        "transport_delay": "a fast multisine: a delay turns the phase in proportion to frequency",
        "unmodelled_mode": "a slow sweep of small amplitude through the band of the gap",
        "cubic_stiffness": "the same sweep at two amplitudes: a stiffening spring moves the resonance",
        "friction": "constant slow speeds in both directions, with stops",
        "backlash": "slow reversals at two amplitudes: the lost motion of a play stays the same",
        "torque_ripple": "a constant slow speed over the whole travel, in both directions",
        "wind": "the same record in calm air, or one with long rests in the wind",
        "encoder_quantization": "some motion, then a minute at rest: the reading shows its steps",
        "encoder_eccentricity": "the whole travel at two constant speeds: a reading error keeps its size",
        "sensor_drift": "some motion, then rest for the length of a record",
        "timing_jitter": "a constant fast speed to and fro: errors of the sampling grow with speed",
        "gain_asymmetry": "equal steps from zero to both sides",
        "outliers": "some motion, then a minute at rest: glitches stay",
    }
)
"""What a record must hold to show each effect alone; every one moves the axis, as a record must."""


def confusable_pairs(
    answer: tuple[str, ...], scores: Mapping[tuple[str, ...], float], least: float
) -> list[tuple[str, str]]:
    """Pairs (named, rival) where putting the rival in place of the named label costs no more than `least`."""
    if not answer or answer == ("other",) or answer not in scores:
        return []
    found = []
    for labels, value in scores.items():
        if len(labels) != len(answer) or scores[answer] - value > least:
            continue
        named, rivals = set(answer) - set(labels), set(labels) - set(answer)
        if len(named) == 1:
            found.append((named.pop(), rivals.pop()))
    return found


def next_experiment(answer: Sequence[str], confusable: Sequence[tuple[str, str]]) -> str | None:
    """The experiment for the first pair left open, or for a gap without a name; None where nothing is."""
    if tuple(answer) == ("other",):
        return (
            "repeat one of the records unchanged: what repeats belongs to the axis, what does not to its "
            "surroundings"
        )
    if not confusable:
        return None
    named, rival = confusable[0]
    wanted = [f"for {label}, {SHOWS[label]}" for label in (named, rival) if label in SHOWS]
    if not wanted:
        wanted = ["slow reversals of small amplitude, then the same at twice the amplitude"]
    return f"{named} or {rival}: {'; '.join(wanted)}"
