"""What to do about each effect, for an axis on the ground, and the experiment that confirms it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType

from bayes_hw.gap.answer.confusable import SHOWS, next_experiment
from bayes_hw.gap.joint.joint_posterior import JointPosterior
from bayes_hw.gap.joint.joint_search import JointAnswer

REMEDIES: Mapping[str, str] = MappingProxyType(
    {
        "rate_limit": "plan trajectories within the ramp, or raise the ramp in the drive's parameters",
        "saturation_drift": "look for rail or bearing load where the limit is low; plan with the lowest",
        "command_bias": "trim the offset of the drive's analogue input, or send the opposite offset",
        "gain_drift": "warm the drive up before tracking, or let the position loop's integral take it up",
        "cubic_stiffness": "tune the loop for both ends of the stiffness; notches at one frequency will miss",
        "friction": "feed the friction torque forward at reversals; look at lubrication and pre-load first",
        "backlash": "bias two pinions against each other, or approach targets from one side",
        "torque_ripple": "feed it forward over position; at its period look for a tooth, a pole, a joint",
        "wind": "no simulation follows it: design the loop's disturbance rejection for its spectrum",
        "encoder_quantization": "use the encoder's interpolation or a finer disc; average at rest",
        "encoder_eccentricity": "correct the reading by a table over position, or read two opposite heads",
        "sensor_drift": "let the mount settle, or refer the angle to stars often enough",
        "timing_jitter": "stamp samples where they are taken; check the bus for late or repeated ones",
        "gain_asymmetry": "calibrate the output's scale on either side of zero",
        "outliers": "check the encoder's cable and screen; reject single jumps before the loop sees them",
        "other": "keep the band for planning and do the experiment below before any remedy",
    }
)


def advice_on(answer: Sequence[str], posterior: JointPosterior, found: JointAnswer) -> list[str]:
    """A sentence for every label of the answer, with its size where the records tell one."""
    said = []
    for label in answer:
        size = _size(label, posterior, found)
        said.append(f"{label}: {size}{REMEDIES.get(label, 'see the next experiment')}")
    return said


def _size(label: str, posterior: JointPosterior, found: JointAnswer) -> str:
    draws, units = posterior.effects, posterior.units
    output = units.get("dead_zone.half_width", "")
    if label == "friction" and "friction.displacement" in draws:
        step = 2 * float(draws["friction.displacement"].mean())
        side = (
            "load" if any("load" in n for n in posterior.fit.names if n.startswith("friction")) else "motor"
        )
        return f"at the {side}; a slow reversal lags by about {step:.3g} {output} until the loop winds up; "
    if label == "backlash" and "backlash.half_gap" in draws:
        return f"{2 * float(draws['backlash.half_gap'].mean()):.3g} {output} are lost at every reversal; "
    if label in ("encoder_eccentricity", "torque_ripple") and f"{label}.period" in draws:
        return f"it repeats every {float(draws[f'{label}.period'].mean()):.4g} {output}; "
    key = f"{label}.step"
    if key in found.readings.parameters:
        return f"a step of {found.readings.parameters[key]:.3g} {output}; "
    return ""


def experiment_for(answer: Sequence[str], confusable: Sequence[tuple[str, str]]) -> str:
    """The experiment that would tell rivals apart, confirm the answer, or look further."""
    asked = next_experiment(answer, confusable)
    if asked is not None:
        return asked
    if not answer:
        return "nothing is missing here; slow reversals with rests between would test friction and play"
    if answer[0] == "friction":
        return "to confirm friction: slow triangles at three rates, through rest and in both directions"
    return f"to confirm {answer[0]}: {SHOWS.get(answer[0], 'repeat one of the records unchanged')}"
