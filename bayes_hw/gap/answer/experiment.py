"""The experiment that tells apart what the records leave open, confirms an answer, or looks further."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from bayes_hw.gap.answer.judgement import OTHER

SHOWS: Mapping[str, str] = MappingProxyType(
    {
        "rate_limit": "steps of the command of two sizes, each held: the ramp's length grows with the step",
        "saturation_drift": "the same saturating step from several positions over the travel",
        "command_bias": "some motion, then a minute of zero command: the axis creeps on",
        "gain_drift": "the same slow triangles at once and an hour later, drives warm",
        "transport_delay": "a fast multisine: a delay turns the phase in proportion to frequency",
        "unmodelled_mode": "a slow sweep of small amplitude through the band of the gap",
        "cubic_stiffness": "the same sweep at two amplitudes: the resonance moves with the amplitude",
        "friction": (
            "slow triangles at three rates, through rest and in both directions: the lag "
            "after a reversal does not grow with the speed"
        ),
        "backlash": "slow reversals at two amplitudes: the lost angle stays the same",
        "torque_ripple": "a constant slow speed over the whole travel, in both directions, at two rates",
        "wind": "the same record in calm air, or one with long rests in the wind",
        "encoder_quantization": "some motion, then a minute at rest: the reading shows its steps",
        "encoder_eccentricity": (
            "the whole travel at two constant speeds: a reading error keeps its size, a torque's does not"
        ),
        "sensor_drift": "some motion, then rest for the length of a record",
        "timing_jitter": "a constant fast speed to and fro: errors of the instants grow with speed",
        "gain_asymmetry": "equal steps from zero to both sides",
        "outliers": "some motion, then a minute at rest: glitches stay",
    }
)
"""What a record must hold to show each effect alone; every one moves the axis, as a record must."""

SHOWS_NOTHING_ALONE = "slow reversals of small amplitude, then the same at twice the amplitude"
"""What a record must hold to show an effect from outside the catalogue."""

REPEATED = (
    "one of the records again, unchanged: what repeats belongs to the axis, what does not to its "
    "surroundings; then slow triangles at three rates"
)
"""For a gap without a name."""

NOTHING_IS_MISSING = (
    "nothing is missing here; slow triangles at three rates with rests between would test friction and play "
    "further"
)


def experiment_for(answer: Sequence[str], confusable: Sequence[tuple[str, str]]) -> str:
    """The experiment for the first pair (named, rival) left open, for a gap without a name, to confirm the
    first label of an answer, or to look further where nothing is missing; never empty."""
    if OTHER in answer[:1]:
        return REPEATED
    if confusable:
        named, rival = confusable[0]
        wanted = [f"for {label}, {SHOWS[label]}" for label in (named, rival) if label in SHOWS]
        return f"{named} or {rival}: {'; '.join(wanted) or SHOWS_NOTHING_ALONE}"
    if answer:
        return f"to confirm {answer[0]}: {SHOWS.get(answer[0], SHOWS_NOTHING_ALONE)}"
    return NOTHING_IS_MISSING
