"""Every label in words: what it looks like in a record, how it is told from its neighbours, what to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Description:
    """What an engineer should know of an effect.

    `title` is its name in words, `meaning` one line, `looks` what it looks like in a record, `neighbours` how
    it is told from other labels, `remedy` what can be done about it on the axis, `law` the equation and
    source of a noise; effects of the response state theirs in the docstrings of their classes.
    """

    title: str
    meaning: str
    looks: str
    neighbours: Mapping[str, str]
    remedy: str
    law: str = ""


DESCRIPTIONS: Mapping[str, Description] = MappingProxyType(
    {
        "rate_limit": Description(
            "Rate limit",
            "the velocity command is ramped: its rate of change is limited",
            "After a step of the command the axis starts along a ramp whose length grows with the step. Slow "
            "sweeps are followed as before; the error sits in the first moments after jumps and in fast "
            "reversals.",
            {
                "transport_delay": "A delay moves every command by the same time; a ramp takes longer for "
                "larger steps and none for small ones.",
                "gain_drift": "A drifting gain errs also where the command is constant.",
            },
            "Read the acceleration limit of the drive or the ramp of the position controller and put it into "
            "the simulator; shape the commands so that they stay below it.",
        ),
        "saturation_drift": Description(
            "Limits that vary with position",
            "the saturation limits vary with the axis position",
            "Only while the command exceeds the limits: the speed of a saturated slew rises and falls with "
            "the angle, in the same places in every record.",
            {
                "gain_drift": "A gain errs below the limits too, and follows time, not the angle.",
                "torque_ripple": "A ripple acts at every speed, and most at slow ones.",
            },
            "Look at what loads the drive at these angles: balance, rail, cable. If the limit is one of "
            "torque, slew more slowly there.",
        ),
        "command_bias": Description(
            "Command bias",
            "a constant offset is added to the velocity command after the limiter",
            "With command zero the axis creeps at a constant speed; between simulator and record a straight "
            "line in time opens up, broken only where the axis saturates.",
            {
                "sensor_drift": "An offset of the command moves the axis: the dead zone holds it back and "
                "the limits cut it off. A drifting encoder knows neither.",
                "gain_asymmetry": "Unequal gains err with the angle; a bias errs at rest too.",
            },
            "Zero the analogue input of the drive (or its digital offset) and record a minute of zero "
            "command.",
        ),
        "gain_drift": Description(
            "Gain drift",
            "the drive's gain changes over the record, warm-up like",
            "The same command moves the axis faster or slower at the end of a record than at its start, and "
            "the change slows down as the drives get warm.",
            {
                "sensor_drift": "A drifting encoder errs at rest, a drifting gain only while the axis moves.",
                "command_bias": "A bias errs without a command.",
                "saturation_drift": "Limits that vary with position err only while saturated, and by angle.",
            },
            "Warm up before measuring; find out what warms up: tachometer, amplifier, oil.",
        ),
        "transport_delay": Description(
            "Transport delay",
            "more delay than the model has, whole or fractional samples",
            "The record is the simulation, later: the error is in proportion to the speed and changes sign "
            "with it. The phase lags in proportion to frequency while the magnitude stays.",
            {
                "timing_jitter": "Jitter is different from sample to sample; a delay repeats.",
                "rate_limit": "A ramp depends on the size of a step, a delay does not.",
                "unmodelled_mode": "A mode changes magnitude and phase around one frequency.",
            },
            "Look for a filter, a fieldbus cycle or a time stamp taken elsewhere; put the delay into the "
            "model, or the phase margin of the loop is overrated.",
        ),
        "unmodelled_mode": Description(
            "Unmodelled mode",
            "a lightly damped structural mode that the model lacks",
            "A ringing at one frequency after steps and in a sweep's passage through that frequency, dying "
            "away slowly; a dip and a peak in the frequency response.",
            {
                "cubic_stiffness": "A stiffening spring moves an existing resonance with the amplitude; a "
                "further mode stays at its frequency.",
                "torque_ripple": "The frequency of a ripple goes with the speed of the axis.",
                "transport_delay": "A delay has no frequency of its own.",
            },
            "Find the member that swings (feed legs, subreflector, panel): a tap test at that frequency. "
            "Add a notch filter, or keep commands out of the band.",
        ),
        "cubic_stiffness": Description(
            "Nonlinear stiffness",
            "the drive train's torsional spring stiffens (or softens) with deflection",
            "The first resonance moves with amplitude: up where the spring stiffens, down where it softens. "
            "Fast sweeps may jump from one branch to the other.",
            {
                "unmodelled_mode": "A further mode does not move with the amplitude.",
                "backlash": "Free play softens small deflections, a stiffening spring large ones.",
            },
            "Look at preload, bolted joints and gear teeth; design the loop for the range of resonances, "
            "not for one.",
        ),
        "friction": Description(
            "Friction",
            "Coulomb, Stribeck or presliding friction at motor or load",
            "At reversals and starts from rest the axis lags behind the simulation by a jump that does not "
            "depend on speed; slow motion sticks and slips. In the missing force over speed there is a step"
            " at zero.",
            {
                "backlash": "Play loses the same angle at every reversal; friction loses what the velocity "
                "loop's integrator needs to wind up, which takes time.",
                "wind": "Wind goes on while the axis rests and does not know its direction.",
                "torque_ripple": "A ripple changes with position, not with the sign of the speed.",
            },
            "Lubrication, bearing preload, rail; in the controller a feed-forward of the friction torque, "
            "and no more integral action than its limit cycle allows.",
        ),
        "backlash": Description(
            "Backlash",
            "hysteretic play (with memory), kinematic or with impacts, beyond the static dead zone",
            "After every reversal the output stands still until the play is crossed, by the same angle at "
            "any speed. With impacts the motion is chaotic: two runs of one command differ.",
            {
                "friction": "Friction at reversals grows with the torque needed and heals with time; play "
                "has one width.",
                "cubic_stiffness": "A nonlinear spring has no flat part.",
                "encoder_quantization": "Steps of the encoder are there in motion of one direction too.",
            },
            "Gear adjustment, or counter-torque between two motors; an encoder on the load side; expect a "
            "limit cycle and see `bayes-hw design`.",
        ),
        "torque_ripple": Description(
            "Torque ripple",
            "a torque periodic in axis position: cogging, gear mesh, rail unevenness",
            "At constant speed the speed itself oscillates, with a frequency in proportion to the speed; in "
            "the missing force over position there is a wave that repeats in every record.",
            {
                "encoder_eccentricity": "A reading error keeps its size at any speed; the motion under a "
                "ripple shrinks as the speed grows past the resonance.",
                "unmodelled_mode": "A mode keeps its frequency.",
                "friction": "Friction depends on the sign of the speed alone.",
            },
            "The period names the part: pole pitch, tooth, roller or joint of the rail. Feed-forward by "
            "position, or repair.",
        ),
        "wind": Description(
            "Wind",
            "a slow coloured load torque that no record shows",
            "Slow, irregular motion that no command explains, also while the axis is at rest, filtered by "
            "the structure; two records of one command differ by it.",
            {
                "sensor_drift": "A wandering encoder does not pass through the dynamics of the axis and does "
                "not stop inside the dead zone.",
                "friction": "Friction needs motion.",
            },
            "It cannot be predicted, so naming it closes nothing: measure the wind beside the axis, and "
            "judge the loop's rejection of disturbances.",
            "A load torque tau' = -tau / T + white noise, smoothed once more, through the drive train to the "
            "encoder; its likelihood is that of a Kalman filter (Davenport, doi 10.1002/qj.49708737208).",
        ),
        "encoder_quantization": Description(
            "Encoder quantization",
            "the measured angle is rounded to a step well above the noise",
            "The reading climbs in stairs; at rest it stays on one value or flips between two.",
            {
                "timing_jitter": "Held samples stay for a sample or two, whatever the size of a step.",
                "backlash": "Play holds the reading at reversals only.",
                "outliers": "A glitch leaves the stairs and comes back.",
            },
            "Read the encoder's finer bits, or interpolate; check the units of the log's columns: rounding "
            "often happens when the file is written.",
            "y = step round((w + noise - offset) / step): every reading is an interval, and its likelihood "
            "the probability of that interval under the noise.",
        ),
        "encoder_eccentricity": Description(
            "Encoder eccentricity",
            "a measurement error periodic in axis position",
            "A wave over the angle, one turn of the disc (or half a turn, where it is oval) long, of the "
            "same size at any speed.",
            {
                "torque_ripple": "A torque's effect on the angle depends on speed; a reading error does not.",
                "gain_asymmetry": "Unequal gains bend the angle once, at zero.",
            },
            "Two reading heads on opposite sides, or a correction table from a star pointing model.",
        ),
        "sensor_drift": Description(
            "Sensor drift",
            "the measured angle drifts: ramp, thermal settling or random walk",
            "The error moves slowly, at rest as in motion, as a ramp, towards a new value, or to and fro.",
            {
                "command_bias": "A bias moves the axis, which limits and dead zone show.",
                "wind": "Wind passes through the dynamics of the axis.",
                "gain_drift": "A gain drifts only while the axis moves.",
            },
            "Look at the encoder's mount and its temperature; take a reference mark before and after.",
        ),
        "timing_jitter": Description(
            "Timing jitter",
            "samples are taken off their nominal instants, or held and repeated",
            "Noise that grows with the speed of the axis, or readings repeated for a sample or more; "
            "nothing of it at rest.",
            {
                "transport_delay": "A delay is the same for all samples.",
                "outliers": "Glitches are there at rest too.",
                "encoder_quantization": "Rounding does not grow with speed.",
            },
            "Have angle and time stamp latched together in hardware; log the stamp of the reading, not of "
            "the message.",
            "y(k) = w(t(k) + e(k)), e independent and normal; or y(k) = y(k - 1) with a probability, whose "
            "likelihood is a forward algorithm over the age of the reading.",
        ),
        "gain_asymmetry": Description(
            "Unequal gains",
            "the output gain differs between positive and negative w (c2 and c3 of the dead-zone map)",
            "On one side of zero the angle is too large or too small in proportion; the error is that of a "
            "scale with a kink at zero.",
            {
                "encoder_eccentricity": "A wave comes back; a gain goes on.",
                "command_bias": "A bias errs at rest.",
            },
            "Check the scale of the two directions (gear, tachometer, amplifier's two halves), and whether "
            "the angle's zero is where the model thinks it is.",
        ),
        "outliers": Description(
            "Glitches",
            "isolated encoder glitches",
            "Single samples far off, back with the next; whatever the axis does.",
            {
                "timing_jitter": "Jitter grows with speed.",
                "encoder_quantization": "Rounding is never more than half a step off.",
            },
            "Cable, shield and the encoder's parity bit; until then `--noise student-t`, under which "
            "outliers do not pull.",
            "y = w + noise, but for a small share of samples that come from a distribution many times as "
            "wide.",
        ),
    }
)
"""The 17 labels of the built-in catalogue."""
