"""corrected.json: model.json with the answer's effects, which can be simulated."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray, IntArray
from bayes_hw.errors import InputError
from bayes_hw.files import read_small_text
from bayes_hw.gap.answer.corrected_train import KEY, TrainSimulation, predict_train, simulate_train
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.fit.unreached_limits import LOWER, UPPER, standing_outermost
from bayes_hw.gap.joint.forms.drive_forms import GIVEN_FORMS
from bayes_hw.gap.joint.forms.effect_form import JointScale
from bayes_hw.gap.joint.posterior.joint_posterior import JointPosterior
from bayes_hw.gap.joint.posterior.reported_quantities import effect_quantities, gain_and_lag
from bayes_hw.gap.joint.response.joint_response import JointResponse
from bayes_hw.gap.joint.response.joint_values import Effect, Ports
from bayes_hw.gap.joint.response.kernel_numbers import Simulated
from bayes_hw.gap.joint.search.known_input import form_named
from bayes_hw.gap.joint.search.observer import unobserved
from bayes_hw.identify.cascade import Structure
from bayes_hw.identify.cascade_roots import linear_block
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.known_input import NO_COLUMNS, READING, TORQUE, KnownInput
from bayes_hw.model.linear import Mode
from bayes_hw.record import Record

SCHEMA = "bayes-hw/corrected/1"
DRAWS_KEPT = 600
SILENT = 1e-9
"""Share of the largest part of a known input's response below which a pole has no part in it."""

COINCIDING = 1e-6
"""Share by which two equal real poles are put apart, so that they have residues."""


def corrected_model(
    name: str, train: Sequence[Record], posterior: JointPosterior, sigma: float
) -> dict[str, object]:
    """The content of corrected.json: a model.json with "effects", and below "joint" what simulates them."""
    fit, kept_coordinates = unobserved(posterior.fit)
    values = fit.values
    model = model_of(f"{name}, corrected", train, fit, sigma, posterior.sections)
    s = fit.structure
    found: dict[str, object] = dict(model.to_dict())
    kept = values.effects
    quantities = effect_quantities(fit, values)
    found["effects"] = [
        {
            "label": e.form.label,
            "form": e.form.name,
            "parameters": {
                key.split(".", 1)[1]: value
                for key, value in quantities.items()
                if key.split(".")[0] == e.form.label
            },
        }
        for e in kept
        if not e.form.column
    ]
    found["records"] = [{"name": r.name, "sha256": r.sha256} for r in train]
    scale = fit.response.scale
    found["joint"] = {
        "schema": SCHEMA,
        "structure": {
            "delay_samples": s.delay_samples, "integrator": s.integrator, "real_poles": s.real_poles,
            "sections": s.sections, "lower": s.lower, "upper": s.upper, "dead_zone": s.dead_zone,
        },
        "scale": {
            "speed": scale.speed, "gain": scale.gain, "travel": scale.travel, "sigma": scale.sigma,
            "samples": scale.samples, "rate_hz": scale.rate_hz, "shortest": scale.shortest,
        },
        "effects": [
            {
                "label": e.form.label, "form": e.form.name,
                "signal": e.looks_at_states,
            }
            for e in kept
        ],
        "steps": fit.response.steps,
        "coordinates": fit.point.coordinates.tolist(),
        "draws": _drawn(posterior, kept_coordinates).tolist(),
    }  # fmt: skip
    return found


def _drawn(posterior: JointPosterior, kept: IntArray) -> FloatArray:
    """Draws (draws, size) of the coordinates; a limit that no command reaches is drawn as it is reported."""
    draws = posterior.coordinates[:DRAWS_KEPT, kept].copy()
    structure = posterior.fit.structure
    limits = [name for name, present in ((LOWER, structure.lower), (UPPER, structure.upper)) if present]
    for name in standing_outermost(posterior.fit):
        if name in limits and name in posterior.base:
            draws[:, limits.index(name)] = posterior.base[name][:DRAWS_KEPT]
    return draws


def model_of(
    name: str, train: Sequence[Record], fit: JointFit, sigma: float, sections: Sequence[int]
) -> HammersteinWiener:
    """The cascade of a fit with its known inputs, without its effects; a limit that it lacks stands at the
    largest command; `sections` are the numbers of the dominant modes' sections."""
    values, rate = fit.values, fit.response.scale.rate_hz
    cascade = values.cascade
    largest = max(float(np.abs(r.u).max()) for r in train)
    modes = [Mode.from_pole(section_pole(*cascade.sections[:2, i]), rate) for i in sections]
    return HammersteinWiener(
        name=name,
        sample_rate_hz=rate,
        saturation=Saturation(
            cascade.lower if np.isfinite(cascade.lower) else -largest,
            cascade.upper if np.isfinite(cascade.upper) else largest,
        ),
        linear=linear_block(fit.structure, cascade),
        dead_zone=DeadZone(cascade.half_width),
        dominant_modes=tuple(modes),
        noise_sigma=sigma,
        units=train[0].units,
        known=tuple(
            known_input_of(fit, effect, train[0].known_units.get(effect.form.column, ""))
            for effect in values.effects
            if effect.form.is_known_input
        ),
    )


def known_input_of(fit: JointFit, effect: Effect, unit: str) -> KnownInput:
    """An effect that is a known input, as a model has it."""
    column, delay, cascade = effect.form.column, float(effect.values[-1]), fit.values.cascade
    cycles = fit.response.column_cycles[column]
    gain, _ = gain_and_lag(effect, fit.values, cycles)
    if (p := effect.ports) is None:
        return KnownInput(column, READING, gain, delay, cycles, unit)
    poles = [p.direct[1], *cascade.real[0]]
    residues = [p.direct[0], *p.real]
    for (a1, a2), (one, two) in zip(cascade.sections[:2].T, p.sections.T, strict=True):
        pair = np.roots([1.0, -a1, a2]).astype(np.complex128)
        if abs(pair[0] - pair[1]) < COINCIDING:
            pair = pair * np.array([1 - COINCIDING, 1 + COINCIDING])
        poles += pair.tolist()
        residues += [(one * pair[i] + two) / (pair[i] - pair[1 - i]) for i in (0, 1)]
    everywhere = np.array(poles, dtype=np.complex128), np.array(residues, dtype=np.complex128)
    size = np.abs(everywhere[1]) / np.abs(1 - everywhere[0])
    everywhere = everywhere[0][size > SILENT * size.max()], everywhere[1][size > SILENT * size.max()]
    return KnownInput(column, TORQUE, gain, delay, cycles, unit, everywhere[0], everywhere[1] / gain)


def section_pole(a1: float, a2: float) -> complex:
    """The upper pole of a section; on the real axis where its poles are real."""
    return complex(a1 / 2, np.sqrt(max(a2 - a1 * a1 / 4, 0.0)))


def joint_response_of(data: Mapping[str, Any]) -> tuple[JointResponse, FloatArray, FloatArray]:
    """Response, coordinates (size,) and draws (draws, size) of a corrected.json; raises InputError."""
    try:
        joint = data["joint"]
        s = Structure(**joint["structure"])
        scale = JointScale(**joint["scale"])
        template = []
        for item in joint["effects"]:
            form = form_named(item["label"], item["form"]) or next(
                f for f in GIVEN_FORMS if f.label == item["label"] and f.name == item["form"]
            )
            ports = None
            if form.is_law:
                none = Ports.none(s.real_poles, s.sections)
                ports = Ports(
                    none.real,
                    none.sections,
                    none.direct,
                    none.signal_real,
                    none.signal_sections,
                    bool(item["signal"]),
                )
            template.append(Effect(form, np.ones(len(form.slots(scale))), ports))
        response = JointResponse(s, tuple(template), (), scale, steps=int(joint.get("steps", 1)))
        coordinates = np.array(joint["coordinates"], dtype=np.float64)
        draws = np.array(joint["draws"], dtype=np.float64).reshape(-1, response.size)
    except (KeyError, TypeError, ValueError, StopIteration) as error:
        raise InputError(f"joint: is not what diagnose writes ({error}); give a corrected.json") from None
    if coordinates.shape != (response.size,) or not np.isfinite(coordinates).all():
        raise InputError(f"joint.coordinates: must be {response.size} finite numbers; give a corrected.json")
    return response, coordinates, draws


def simulate_corrected(
    data: Mapping[str, Any], u: FloatArray, known: Mapping[str, FloatArray] = NO_COLUMNS
) -> Simulated | TrainSimulation:
    """Noise-free response of a corrected.json to a command and known inputs (samples,) from rest."""
    if KEY in data:
        return simulate_train(data, u)
    response, coordinates, _ = joint_response_of(data)
    return response.simulate(response.values(coordinates), u, known)


def predict_corrected(
    data: Mapping[str, Any],
    u: FloatArray,
    known: Mapping[str, FloatArray] = NO_COLUMNS,
    level_sd: float = 0.0,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean and 94 % band of y (samples,) under a command and known inputs; parameters, noise and the level
    that angles count from, known to `level_sd`, are counted."""
    if KEY in data:
        return predict_train(data, u)
    response, coordinates, draws = joint_response_of(data)
    mean = response.simulate(response.values(coordinates), u, known).y
    spread = np.zeros_like(mean)
    if len(draws):
        drawn = [response.simulate(response.values(x), u, known).y for x in draws]
        low, high = np.quantile(drawn, [0.16, 0.84], axis=0)
        spread = (high - low) / 2
    sigma = float(data.get("noise", {}).get("sigma", 0.0))
    half = NORMAL_HALF_WIDTH * np.sqrt(spread**2 + sigma**2 + level_sd**2)
    return mean, mean - half, mean + half


def read_corrected(path: Path | str) -> dict[str, Any] | None:
    """The content of a corrected.json; None where the file is a plain model or cannot be read as JSON."""
    try:
        data = json.loads(read_small_text(Path(path)))
    except (OSError, ValueError, RecursionError):
        return None
    return data if isinstance(data, dict) and ("joint" in data or KEY in data) else None
