"""Posterior of the joint fit: a normal in its coordinates (Laplace), carried to what is reported."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.leading_sample import leading_draws
from bayes_hw.gap.joint.fit.unreached_limits import unreached_limits
from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812
from bayes_hw.gap.joint.posterior.torque_scale import acceleration_draws, acceleration_of_unit
from bayes_hw.gap.joint.response.joint_values import Effect, JointValues
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.identify.growth.descent import evaluate, residuals_at, triangular_factor
from bayes_hw.identify.resonances import dominant_modes
from bayes_hw.model.known_input import polar
from bayes_hw.model.linear import Mode
from bayes_hw.record import Units

DRAWS = 300
INFLATION = 1.7
"""Of standard deviations, for structures not chosen and forms a little wrong: see
docs/decisions/0016-joint-search.md."""

RIDGE = 1e-9
NEVER_SETTLES = 1 - 1e-6
"""Pole from which a constant torque moves the axis on and on: no displacement is told."""

RIDGES = (1e-9, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 0.1, 1.0)
"""Least eigenvalues of a correlation matrix, in turn, until a draw is one that the records allow."""

TRIES = 20
"""Normals that a draw may take until its poles are of the fit's kinds."""

CHAOTIC = 1.7
"""Factor on standard deviations where motion is chaotic, so that its torques are held as they are."""

EXPLODED = 1e3
"""Derivatives beyond those of the linear cascade by so much are those of a chaotic motion."""


TORQUES = (K.COULOMB, K.STRIBECK, K.BRISTLE, K.RIPPLE)
"""Laws whose largest value in motion is one."""


@dataclass(frozen=True, eq=False)
class JointPosterior:
    """Draws (draws, size) of the coordinates and of the reported quantities by name, with their units;
    `sections` are the numbers of the dominant modes' sections."""

    fit: JointFit
    coordinates: FloatArray
    base: dict[str, FloatArray]
    effects: dict[str, FloatArray]
    units: dict[str, str]
    sections: tuple[int, ...]


def laplace(
    fit: JointFit,
    units: Units,
    rng: np.random.Generator,
    inflation: float = INFLATION,
    sections: Sequence[int] | None = None,
) -> JointPosterior:
    """Draws about the fit, standard deviations times `inflation`; `sections` as `dominant_sections` has them
    where they are not to be found anew."""
    factor, chaotic = whitened_factor(fit)
    if chaotic:
        inflation *= CHAOTIC
    size = len(factor) - 1
    largest = np.abs(factor[:size, :size]).max(axis=0)
    seen = largest > 0
    largest[~seen] = 1.0
    scaled = factor[:size, :size] / largest
    norms = np.sqrt(np.sum(scaled**2, axis=0))
    norms[~seen] = 1.0
    correlation = (scaled / norms).T @ (scaled / norms)
    variance = float(np.sum(factor[:, size] ** 2)) / fit.point.samples
    scale = largest * norms / np.sqrt(variance)
    values, vectors = np.linalg.eigh(correlation + RIDGE * np.eye(len(scale)))
    centre = fit.point.coordinates
    if chaotic:
        root = vectors / np.sqrt(np.maximum(values, RIDGE))
        steps = inflation * rng.standard_normal((DRAWS, len(scale))) @ root.T / scale
        steps[:, ~seen] = 0.0
        drawn = np.array([fit.response.admissible(centre + step, centre) for step in steps])
    else:
        drawn = _allowed(fit, values, vectors, np.where(seen, scale, np.inf), inflation, rng)
    rate = fit.response.scale.rate_hz
    base: dict[str, list[float]] = {}
    effects: dict[str, list[float]] = {}
    sections = dominant_sections(fit) if sections is None else list(sections)
    for x in drawn:
        values_at = fit.response.values(x)
        for name, value in base_quantities(fit, values_at, sections, rate).items():
            base.setdefault(name, []).append(value)
        for name, value in effect_quantities(fit, values_at).items():
            effects.setdefault(name, []).append(value)
    if chaotic:
        # Torques are held while the poles that they enter by move: what follows from both means nothing.
        effects = {name: draws for name, draws in effects.items() if not name.endswith(".displacement")}
    else:
        effects |= torque_draws(fit, drawn)
    base |= unreached_limits(fit, base, rng)
    base["gain"] = leading_draws(fit, np.array(base["gain"]), inflation, rng).tolist()
    unit = {**base_units(base, units), **effect_units(fit, units)}
    return JointPosterior(
        fit,
        drawn,
        {n: np.array(v) for n, v in base.items()},
        {n: np.array(v) for n, v in effects.items()},
        unit,
        tuple(sections),
    )


def averaged(
    posterior: JointPosterior,
    rivals: Sequence[tuple[JointFit, float]],
    rng: np.random.Generator,
    inflation: float = INFLATION,
) -> JointPosterior:
    """`posterior` with base parameters of explanations in its place, each in so many of the draws as its
    probability says; a mode that one of them lacks is there as in `posterior`."""
    base = {name: draws.copy() for name, draws in posterior.base.items()}
    share = rng.uniform(size=len(posterior.coordinates))
    begin = 0.0
    for fit, probability in rivals:
        taken = (share >= begin) & (share < begin + probability)
        begin += probability
        if not taken.any():
            continue
        for name, draws in laplace(fit, fit.response.records[0].units, rng, inflation).base.items():
            if name in base:
                base[name][taken] = draws[taken]
    return replace(posterior, base=base)


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


def _allowed(
    fit: JointFit, values: FloatArray, vectors: FloatArray, scale: FloatArray, inflation: float,
    rng: np.random.Generator,
) -> FloatArray:  # fmt: skip
    """Draws (draws, size) about the fit that the records allow.

    `values` and `vectors` are of the correlation matrix of whitened derivatives of columns of norms `scale`.
    Along a direction that the records hardly see, the likelihood is normal near the fit only: a step costs
    many times what it should. Such a draw is taken again with the variance along such directions capped.
    Poles are of the fit's kinds: a pair that parts into two real poles is of another structure, of which
    nothing about this fit tells, and a pole that the records do not see goes there half of the time.
    """
    size, centre = len(scale), fit.point.coordinates
    least = fit.point.log_likelihood - 0.5 * inflation**2 * (size + 4 * np.sqrt(2 * size))
    found = np.empty((DRAWS, size))
    begin, kinds = 0, _are_pairs(fit, centre)
    for number in range(DRAWS):
        at = max(begin - 1, 0)
        normal = inflation * rng.standard_normal(size)
        while True:
            root = vectors / np.sqrt(np.maximum(values, RIDGES[at]))
            for _ in range(TRIES):
                found[number] = fit.response.admissible(centre + root @ normal / scale, centre)
                if np.array_equal(_are_pairs(fit, found[number]), kinds):
                    break
                normal = inflation * rng.standard_normal(size)
            residuals = residuals_at(fit.response, found[number], fit.point.whitener)
            trial = replace(fit.point, residuals=residuals)
            finite = all(np.isfinite(e).all() for e in trial.known)
            reached = fit.point.whitener.log_likelihood(residuals, fit.point.masks) if finite else -np.inf
            if at == len(RIDGES) - 1 or reached >= least:
                break
            at += 1
        begin = at
    return found


def _are_pairs(fit: JointFit, coordinates: FloatArray) -> BoolArray:
    """Which sections (sections,) have complex poles."""
    a1, a2 = fit.response.values(coordinates).cascade.sections[:2]
    return np.asarray(a1 * a1 / 4 < a2, dtype=np.bool_)


def whitened_factor(fit: JointFit) -> tuple[FloatArray, bool]:
    """Triangular factor of the whitened derivatives and residual; where the motion is chaotic and no observer
    follows it, with the effects' torques held as they are and their parameters not moved."""
    whole = triangular_factor(fit.response, fit.point)
    if fit.observer is not None or not any(effect.ports is not None for effect in fit.response.template):
        return whole, False
    plain = JointFit(replace(fit.response, template=()), fit.point)
    coordinates = plain.response.coordinates(JointValues(fit.values.cascade))
    point = evaluate(plain.response, coordinates, fit.point.whitener)
    held = triangular_factor(plain.response, point)
    count = len(held) - 1
    largest = np.linalg.norm(held[:count, :count], axis=0)
    size = len(whole) - 1
    if np.all(np.abs(whole[:, :count]).max(axis=0) < EXPLODED * np.maximum(largest, 1e-300)):
        return whole, False
    found = np.zeros_like(whole)
    found[:count, :count] = held[:count, :count]
    found[size, size] = np.sqrt(fit.point.sum_of_squares)
    return found, True


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
    c = values.cascade
    first = c.integrator_residue + c.real[1].sum() + c.sections[2].sum()
    return float(first) if fit.structure.order else float(linear_block(fit.structure, c).gain)


def static_gain(effect: Effect, values: JointValues) -> float:
    """Displacement of w, output units, under a constant unit of the effect's torque."""
    p = effect.ports
    assert p is not None
    c = values.cascade
    settling = c.real[0] < NEVER_SETTLES
    total = float(p.direct[0] / (1 - p.direct[1]))
    total += float(np.sum(p.real[settling] / (1 - c.real[0, settling])))
    a1, a2 = c.sections[:2]
    return total + float(np.sum((p.sections[0] + p.sections[1]) / (1 - a1 + a2)))


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
            elif name in ("time",):
                value = value / rate
            elif name == "log_ratio":
                name, value = "ratio", float(np.exp(value))
            elif (name == "rate" and form.place == "output") or (
                name in ("smoothing_speed", "stribeck_speed") and form.base == K.BASE_SPEED
            ):
                value = value * rate
            elif name in ("gap", "yield", "acceleration"):
                name, value = "acceleration", value * rate**2
            found[f"{label}.{name}"] = value
        if effect.ports is not None:
            found[f"{label}.displacement"] = abs(static_gain(effect, values))
    return found


def torque_draws(fit: JointFit, drawn: FloatArray) -> dict[str, list[float]]:
    """LABEL.torque of laws whose unit is a torque, output units/s^2 of the whole axis, for every draw."""
    found: dict[str, list[float]] = {}
    rate, structure = fit.response.scale.rate_hz, fit.structure
    for number, effect in enumerate(fit.values.effects):
        if effect.form.law not in TORQUES or effect.ports is None:
            continue
        if acceleration_of_unit(structure, fit.values, effect, rate) is None:
            continue
        values = [fit.response.values(x) for x in drawn]
        found[f"{effect.form.label}.torque"] = acceleration_draws(structure, values, number, rate).tolist()
    return found


def effect_units(fit: JointFit, units: Units) -> dict[str, str]:
    """Units of `effect_quantities`."""
    found: dict[str, str] = {}
    for effect in fit.response.template:
        form, label = effect.form, effect.form.label
        speed = f"{units.output}/s" if form.base == K.BASE_SPEED else units.input
        known = {
            "period": units.output, "time": "s", "bias": units.input, "half_gap": units.output,
            "amount": units.output, "displacement": units.output, "phase": "rad",
            "slope": f"1/{units.output}",
            "smoothing_speed": speed, "stribeck_speed": speed, "presliding": units.output,
            "acceleration": f"{units.output}/s^2",
            "torque": f"{units.output}/s^2",
            "rate": f"{units.output}/s" if form.place == "output" else f"{units.input}/s",
        }  # fmt: skip
        if form.place == "output":
            known |= dict.fromkeys(("sine", "cosine", "second_sine", "second_cosine"), units.output)
        for name, unit in known.items():
            found[f"{label}.{name}"] = unit
    return found
