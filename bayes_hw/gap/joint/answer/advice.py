"""What to do about each effect, for an axis on the ground: how large it is in the axis's own terms, and what
is done about it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.answer.words_of_answer import words_of
from bayes_hw.gap.joint.posterior.joint_posterior import JointPosterior
from bayes_hw.gap.joint.posterior.reported_quantities import TORQUES
from bayes_hw.gap.joint.posterior.torque_scale import acceleration_of_unit
from bayes_hw.gap.joint.search.joint_search import JointAnswer
from bayes_hw.phrases import in_percent

DEGREES = MappingProxyType(
    {"deg": 1.0, "rad": 180 / np.pi, "mrad": 0.18 / np.pi, "mdeg": 1e-3, "arcmin": 1 / 60, "arcsec": 1 / 3600}
)
"""Of one output unit, where that is an angle."""

REACHED = 0.995
"""Quantile of the acceleration that is taken for the largest that the drive showed."""


@dataclass(frozen=True)
class Drive:
    """What the user knows of the drive: inertia in kg m^2 of what turns with the encoder and rated torque in
    N m, both as seen at the axis; None where unknown."""

    inertia: float | None = None
    rated_torque: float | None = None


@dataclass(frozen=True, eq=False)
class Sized:
    """What sizes are said from: draws of the effects' parameters, the search's answer, and the drive."""

    posterior: JointPosterior
    found: JointAnswer
    drive: Drive

    @property
    def unit(self) -> str:
        """The output's."""
        return self.posterior.units.get("dead_zone.half_width", "")

    def draws(self, name: str) -> FloatArray | None:
        """Of a parameter named LABEL.NAME."""
        return self.posterior.effects.get(name)

    def said(self, name: str, factor: float = 1.0) -> str | None:
        """Mean and standard deviation of a parameter, times `factor`, in words without its unit."""
        draws = self.draws(name)
        return None if draws is None else plus_minus(factor * draws)

    def torque_at_fit(self, label: str) -> float | None:
        """Of the best fit, output units/s^2; None where it is no torque, or the axis is no single inertia."""
        fit = self.posterior.fit
        for effect in fit.values.effects:
            if effect.form.label == label and effect.ports is not None and effect.form.law in TORQUES:
                return acceleration_of_unit(fit.structure, fit.values, effect, fit.response.scale.rate_hz)
        return None

    def acceleration(self) -> float:
        """The largest acceleration that the drive showed in the records, output units/s^2."""
        fit = self.posterior.fit
        rate = fit.response.scale.rate_hz
        w = [fit.response.simulate(fit.values, record.u, record.known).w for record in fit.response.records]
        return float(np.quantile(np.abs(np.concatenate([np.diff(x, 2) for x in w])), REACHED)) * rate**2


def plus_minus(draws: FloatArray) -> str:
    """Mean +- standard deviation, to its second digit; the number alone where all draws are it."""
    mean, sd = float(draws.mean()), float(draws.std())
    if not (np.isfinite(mean) and np.isfinite(sd) and np.ptp(draws) > 0):
        return f"{mean:.3g}"
    decimals = 1 - int(np.floor(np.log10(sd)))
    return f"{mean:.{max(decimals, 0)}f} +- {sd:.{max(decimals, 0)}f}"


TELLING = 2.0
"""Standard deviations that a size must be above zero to be advised on."""

Size: TypeAlias = Callable[[Sized, str], list[str]]
"""Sentences on how large an effect is."""


def _torque(sized: Sized, label: str) -> list[str]:
    """Torque as acceleration of the axis, as a share of the drive's, in N m where the inertia is known."""
    draws = sized.draws(f"{label}.torque")
    at_fit = sized.torque_at_fit(label)
    if draws is None and at_fit is None:
        return []
    unit, mean = sized.unit, float(draws.mean()) if draws is not None else float(at_fit or 0.0)
    shown = plus_minus(draws) if draws is not None else f"about {mean:.2g}"
    share = mean / max(sized.acceleration(), 1e-300)
    said = [
        f"its torque: {shown} {unit}/s^2 as an acceleration of what turns with the encoder (the load behind "
        f"its gear, or a stiff axis as a whole), {in_percent(share)} of the largest these records show; at a "
        "motor behind the gear it would have to be far larger, by how much records alone do not tell"
    ]
    degrees = DEGREES.get(unit)
    if sized.drive.inertia is not None and degrees is not None:
        per = sized.drive.inertia * float(np.deg2rad(degrees))
        rated = sized.drive.rated_torque
        of = f", {in_percent(per * mean / rated)} of the rated torque" if rated else ""
        newton = plus_minus(per * draws) if draws is not None else f"about {per * mean:.2g}"
        said.append(f"with an inertia of {sized.drive.inertia:g} kg m^2 there that is {newton} N m{of}")
    return said


def _friction(sized: Sized, label: str) -> list[str]:
    said = _torque(sized, label)
    step, draws = sized.said("friction.displacement", 2.0), sized.draws("friction.displacement")
    if step is not None and (draws is None or float(draws.mean()) > TELLING * float(draws.std())):
        said.append(f"a slow reversal lags by {step} {sized.unit} until the velocity loop has wound up")
    return said


def _backlash(sized: Sized, label: str) -> list[str]:
    lost = sized.said(f"{label}.half_gap", 2.0)
    return [] if lost is None else [f"{lost} {sized.unit} are lost at every reversal, whatever the speed"]


def _periodic(sized: Sized, label: str) -> list[str]:
    said = _torque(sized, label)
    sine, cosine = sized.draws(f"{label}.sine"), sized.draws(f"{label}.cosine")
    if sine is not None and cosine is not None:
        said.append(f"the reading errs by {plus_minus(np.hypot(sine, cosine))} {sized.unit} either way")
    period = sized.draws(f"{label}.period")
    if period is not None:
        degrees = DEGREES.get(sized.unit)
        turns = "" if degrees is None else f", {360 / degrees / float(period.mean()):.4g} times a turn"
        said.append(f"it repeats every {plus_minus(period)} {sized.unit} of position{turns}")
    return said


def _rate(sized: Sized, label: str) -> list[str]:
    rate = sized.said(f"{label}.rate")
    return [] if rate is None else [f"the ramp: {rate} {sized.posterior.units.get(f'{label}.rate', '')}"]


def _limits(sized: Sized, label: str) -> list[str]:
    sine, cosine = sized.draws(f"{label}.sine"), sized.draws(f"{label}.cosine")
    if sine is not None and cosine is not None:
        return [f"the limits rise and fall by {plus_minus(100 * np.hypot(sine, cosine))} % with position"]
    slope = sized.said(f"{label}.slope", 100.0)
    return [] if slope is None else [f"the limits change by {slope} % per {sized.unit} of position"]


def _bias(sized: Sized, label: str) -> list[str]:
    draws = sized.draws(f"{label}.bias")
    if draws is None:
        return []
    unit = sized.posterior.units.get(f"{label}.bias", "")
    return [f"{plus_minus(draws)} {unit} with the command at zero, so that the axis creeps by that"]


def _gain(sized: Sized, label: str) -> list[str]:
    change, time = sized.said(f"{label}.change", 100.0), sized.said(f"{label}.time")
    return [] if change is None else [f"the gain changes by {change} % in all, time constant {time} s"]


def _drift(sized: Sized, label: str) -> list[str]:
    rate, amount = sized.said(f"{label}.rate", 3600.0), sized.said(f"{label}.amount")
    if rate is not None:
        return [f"{rate} {sized.unit} an hour"]
    if amount is None:
        return []
    return [f"{amount} {sized.unit} in all, time constant {sized.said(f'{label}.time')} s"]


def _asymmetry(sized: Sized, label: str) -> list[str]:
    draws = sized.draws(f"{label}.ratio")
    return [] if draws is None else [f"above zero the scale is {plus_minus(100 * (draws - 1))} % larger"]


def _readings(sized: Sized, label: str) -> list[str]:
    """Of rounding, late samples, glitches and a rhythm."""
    p, unit = sized.found.readings.parameters, sized.unit
    said = []
    if f"{label}.step" in p:
        degrees = DEGREES.get(unit)
        bits = "" if degrees is None else f", {np.log2(360 / degrees / p[f'{label}.step']):.3g} bits a turn"
        said.append(f"the reading moves in steps of {p[f'{label}.step']:.4g} {unit}{bits}")
    if f"{label}.sd" in p:
        said.append(f"samples are off their instants by {1000 * p[f'{label}.sd']:.3g} ms (one sd)")
    if f"{label}.share_repeated" in p:
        said.append(f"{100 * p[f'{label}.share_repeated']:.3g} % of the readings repeat the one before")
    if f"{label}.share_held" in p:
        said.append(
            f"{100 * p[f'{label}.share_held']:.3g} % of the readings show the angle of one sample earlier"
        )
    if f"{label}.every" in p:
        said.append(
            f"the scatter of the readings repeats every {p[f'{label}.every']:.0f} samples: look at what "
            "takes turns in the encoder, a converter, an interpolation, a multiplexer"
        )
    if f"{label}.rate" in p:
        size = p.get(f"{label}.size", 0.0)
        rate = 1000 * p[f"{label}.rate"]
        said.append(f"{rate:.3g} samples in a thousand are off, by some {size:.3g} {unit}")
    return said


def _nothing(sized: Sized, label: str) -> list[str]:
    del sized, label
    return []


@dataclass(frozen=True)
class Advice:
    """What is done about an effect on the axis, and how its size is said."""

    remedy: str
    size: Size


ADVICE: Mapping[str, Advice] = MappingProxyType(
    {
        "rate_limit": Advice(
            "plan trajectories within the ramp, or raise the ramp in the drive's parameters",
            _rate,
        ),
        "saturation_drift": Advice(
            "look for rail, cable or bearing load where the limit is low; plan with the lowest limit",
            _limits,
        ),
        "command_bias": Advice(
            "trim the offset of the drive's analogue input, or send the opposite offset",
            _bias,
        ),
        "gain_drift": Advice(
            "warm the drive up before tracking, or let the position loop's integral take it up",
            _gain,
        ),
        "transport_delay": Advice(
            "look for a filter, a bus cycle or a stamp taken elsewhere; put the delay into the loop's design",
            _nothing,
        ),
        "unmodelled_mode": Advice(
            "find the member that swings with a tap test; notch it, or keep commands out of its band",
            _nothing,
        ),
        "cubic_stiffness": Advice(
            "tune the loop for both ends of the stiffness: a notch at one frequency misses; check pre-load",
            _nothing,
        ),
        "friction": Advice(
            "feed that torque forward with the sign of the speed; first see to lubrication, bearing pre-load "
            "and, at the load, the rail; keep integral action below its limit cycle",
            _friction,
        ),
        "backlash": Advice(
            "bias two pinions against each other, adjust the gear, or come to targets from one side; "
            "close the loop on an encoder at the load",
            _backlash,
        ),
        "torque_ripple": Advice(
            "feed it forward over position; its period names the part: tooth, pole, roller, rail joint",
            _periodic,
        ),
        "wind": Advice(
            "no simulation follows it: measure the wind beside the axis, and design the loop's rejection of "
            "disturbances for this spectrum",
            _nothing,
        ),
        "encoder_quantization": Advice(
            "use the encoder's interpolation or finer bits; see whether the logger rounds; average at rest",
            _readings,
        ),
        "encoder_eccentricity": Advice(
            "correct the reading by a table over position, or read two opposite heads",
            _periodic,
        ),
        "sensor_drift": Advice(
            "let the encoder's mount settle, look at its temperature, and refer the angle to a mark often",
            _drift,
        ),
        "timing_jitter": Advice(
            "stamp samples where they are taken; check the bus for late or repeated ones",
            _readings,
        ),
        "gain_asymmetry": Advice(
            "calibrate the reading's scale on either side of zero; check where the angle's zero is",
            _asymmetry,
        ),
        "outliers": Advice(
            "check the encoder's cable and screen; reject single jumps before the loop sees them",
            _readings,
        ),
        "other": Advice(
            "use the bands for planning, and do the experiment below before any remedy",
            _readings,
        ),
    }
)
"""Of every label that can be in an answer."""

NOTHING = Advice(
    "nothing is to be done about an effect that no catalogue entry describes",
    _nothing,
)


def advice_on(
    answer: Sequence[str], posterior: JointPosterior, found: JointAnswer, drive: Drive | None = None
) -> list[str]:
    """Sentences for every label of the answer: its size where the records tell one, and what to do."""
    sized = Sized(posterior, found, drive or Drive())
    said = []
    for label in answer:
        advice = ADVICE.get(label, NOTHING)
        name = "cause unknown" if label == "other" else words_of(label)
        said += [f"{name}: {sentence}" for sentence in (*advice.size(sized, label), advice.remedy)]
    return said
