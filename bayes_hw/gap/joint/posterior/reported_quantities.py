"""What is reported of a joint fit at given values: base parameters, modes, effects, and their units."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.leading_sample import first_samples
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.posterior.torque_scale import acceleration_draws
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.identify.cascade_roots import linear_block, section_poles
from bayes_hw.identify.resonances import dominant_modes
from bayes_hw.model.known_input import polar
from bayes_hw.model.linear import Mode
from bayes_hw.record import Units

SAME_MODE = 0.25
"""Logarithm of the frequencies of two explanations within which a mode is the same."""

TORQUES = (K.COULOMB, K.STRIBECK, K.BRISTLE, K.RIPPLE)
"""Laws whose largest value in motion is one."""


def base_units(names: Iterable[str], units: Units) -> dict[str, str]:
    """Units of base parameters."""
    gain = f"{units.output}/{units.input}" if units.input.isalnum() else f"{units.output}/({units.input})"
    known = {
        "saturation.lower": units.input,
        "saturation.upper": units.input,
        "dead_zone.half_width": units.output,
        "gain": gain,
    }
    return known | {name: "Hz" for name in names if name.endswith("frequency_hz")}


def dominant_sections(fit: JointFit) -> list[int]:
    """Which sections are dominant modes, in order of frequency; of two whose resonances overlap, one mode to
    the eye, the less damped."""
    cascade, rate = fit.values.cascade, fit.response.scale.rate_hz
    modes = dominant_modes(fit.structure, cascade, rate, fit.response.scale.samples / rate)
    found = []
    for mode in modes:
        if any(
            abs(mode.frequency_hz - m.frequency_hz) < _half_width(mode) + _half_width(m)
            and (m.damping_ratio, m.frequency_hz) < (mode.damping_ratio, mode.frequency_hz)
            for m in modes
        ):
            continue
        distance = [
            abs(_mode(a1, a2, rate).frequency_hz - mode.frequency_hz) if a1 * a1 / 4 < a2 else np.inf
            for a1, a2 in cascade.sections[:2].T
        ]
        found.append(int(np.argmin(distance)))
    return found


def sections_of_modes(fit: JointFit, sections: Iterable[int], wider: JointFit) -> list[int]:
    """Where the modes of `sections` of a fit are among those of another one, which a descent may have
    exchanged or drawn apart into real poles: the nearest in frequency, without those that are not there."""
    rate, found = fit.response.scale.rate_hz, list[int]()
    theirs = {
        i: _mode(a1, a2, rate).frequency_hz
        for i, (a1, a2) in enumerate(wider.values.cascade.sections[:2].T)
        if a1 * a1 / 4 < a2
    }
    for section in sections:
        a1, a2 = fit.values.cascade.sections[:2, section]
        here = _mode(a1, a2, rate).frequency_hz
        distance = {i: abs(np.log(f / here)) for i, f in theirs.items() if i not in found}
        nearest = min(distance, key=lambda i: distance[i], default=None)
        if nearest is not None and distance[nearest] < SAME_MODE:
            found.append(nearest)
    return found


def _half_width(mode: Mode) -> float:
    """Half of the resonance's width at half power, Hz."""
    return mode.damping_ratio * mode.frequency_hz


def _mode(a1: float, a2: float, rate: float) -> Mode:
    return Mode.from_pole(complex(a1 / 2, np.sqrt(max(a2 - a1 * a1 / 4, 1e-300))), rate)


def base_quantities(fit: JointFit, values: JointValues, sections: list[int], rate: float) -> dict[str, float]:
    """Base parameters, named as in posterior.json, less the noise."""
    c = values.cascade
    found = {
        "saturation.lower": c.lower, "saturation.upper": c.upper, "dead_zone.half_width": c.half_width,
        "gain": linear_block_gain(fit, values),
    }  # fmt: skip
    for number, i in enumerate(sections, start=1):
        mode = _mode(c.sections[0, i], c.sections[1, i], rate)
        found[f"mode{number}.frequency_hz"] = mode.frequency_hz
        found[f"mode{number}.damping_ratio"] = mode.damping_ratio
    return {name: value for name, value in found.items() if np.isfinite(value)}


def linear_block_gain(fit: JointFit, values: JointValues) -> float:
    """Leading coefficient of G's numerator: the first sample of its impulse response that is not zero."""
    if fit.structure.order:
        return float(first_samples(values)[0])
    return float(linear_block(fit.structure, values.cascade).gain)


def static_gain(effect: Effect, values: JointValues, samples: int) -> float:
    """Displacement of w, output units, under a constant unit of the effect's torque, by what settles within
    `samples`: by the rest it moves the axis on and on."""
    p = effect.ports
    assert p is not None
    c, slowest = values.cascade, 1 - 1 / samples
    settling = c.real[0] < slowest
    total = float(p.direct[0] / (1 - p.direct[1]))
    total += float(np.sum(p.real[settling] / (1 - c.real[0, settling])))
    for (a1, a2), (one, two) in zip(c.sections[:2].T, p.sections.T, strict=True):
        first, second = section_poles(a1, a2)
        slow, fast = sorted((first.real, second.real), reverse=True)
        if first.imag != 0 or slow < slowest:
            total += float((one + two) / (1 - a1 + a2))
        elif fast < slowest:
            total += float((one * fast + two) / (fast - slow) / (1 - fast))
    return total


def gain_and_lag(effect: Effect, values: JointValues, cycles: float) -> tuple[float, float]:
    """Of a known input at `cycles` per sample: output units a unit of its column, and samples."""
    late = float(effect.values[-1])
    if (p := effect.ports) is None:
        return float(effect.values[0]), late
    c, q = values.cascade, np.exp(-2j * np.pi * cycles)
    a1, a2 = c.sections[:2]
    total = p.direct[0] * q / (1 - p.direct[1] * q) + np.sum(p.real * q / (1 - c.real[0] * q))
    total += np.sum((p.sections[0] * q + p.sections[1] * q * q) / (1 - a1 * q + a2 * q * q))
    return polar(complex(total), cycles, late)


def effect_quantities(fit: JointFit, values: JointValues) -> dict[str, float]:
    """Parameters of the effects in the units that are reported; of a known input its gain, output units a
    unit of the column (of a torque what it displaces w by when constant), and by how many s w follows a slow
    change of it."""
    rate = fit.response.scale.rate_hz
    found: dict[str, float] = {}
    for effect in values.effects:
        form, label = effect.form, effect.form.label
        if form.law == K.INNOVATION:
            continue
        if form.column:
            gain, late = gain_and_lag(effect, values, fit.response.column_cycles[form.column])
            found[f"{label}.gain"], found[f"{label}.lag"] = gain, late / rate
            continue
        for slot, x in zip(form.slots(fit.response.scale), effect.values, strict=True):
            name, value = slot.name, float(x)
            if name == "wavenumber":
                name, value = "period", 2 * np.pi / value
            elif name == "slowness":
                name, value = "rate", rate / max(value, 1e-12)
            elif name in ("time", "lead"):
                value = value / rate
            elif name == "log_ratio":
                name, value = "ratio", float(np.exp(value))
            elif (name == "rate" and form.place == "output") or (
                name.removeprefix("twist_") in ("smoothing_speed", "stribeck_speed")
                and form.base == K.BASE_SPEED
            ):
                value = value * rate
            elif name in ("gap", "yield", "acceleration"):
                name, value = "acceleration", value * rate**2
            found[f"{label}.{name}"] = value
        if effect.ports is not None:
            found[f"{label}.displacement"] = abs(static_gain(effect, values, fit.response.scale.samples))
    return found


def torque_draws(fit: JointFit, drawn: FloatArray, rng: np.random.Generator) -> dict[str, list[float]]:
    """LABEL.torque of laws whose unit is a torque, as the acceleration, output units/s^2, of what turns with
    the encoder, for every draw; without those that the records do not tell."""
    found: dict[str, list[float]] = {}
    rate, structure = fit.response.scale.rate_hz, fit.structure
    every = [fit.response.values(x) for x in drawn]
    for number, effect in enumerate(fit.values.effects):
        if effect.form.law not in TORQUES or effect.ports is None:
            continue
        accelerations = acceleration_draws(structure, fit.values, every, number, rate, rng)
        if accelerations is not None:
            found[f"{effect.form.label}.torque"] = accelerations.tolist()
    return found


def effect_units(fit: JointFit, units: Units) -> dict[str, str]:
    """Units of `effect_quantities`."""
    found: dict[str, str] = {}
    for effect in fit.response.template:
        form, label = effect.form, effect.form.label
        speed = f"{units.output}/s" if form.base == K.BASE_SPEED else units.input
        known = {
            "period": units.output, "time": "s", "lead": "s", "bias": units.input, "half_gap": units.output,
            "amount": units.output, "displacement": units.output, "phase": "rad",
            "slope": f"1/{units.output}",
            "smoothing_speed": speed, "stribeck_speed": speed, "presliding": units.output,
            "twist_smoothing_speed": speed, "twist_stribeck_speed": speed, "twist_presliding": units.output,
            "acceleration": f"{units.output}/s^2",
            "torque": f"{units.output}/s^2",
            "rate": f"{units.output}/s" if form.place == "output" else f"{units.input}/s",
        }  # fmt: skip
        if form.place == "output":
            known |= dict.fromkeys(("sine", "cosine", "second_sine", "second_cosine"), units.output)
        for name, unit in known.items():
            found[f"{label}.{name}"] = unit
    return found
