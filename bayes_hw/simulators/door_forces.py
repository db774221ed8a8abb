"""Effects of the catalogue in a MuJoCo model: by its own means where it has them, else as laws."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.simulators.edits import CUBIC, FRICTION_TIME, SPRING_BAND, Edit
from bayes_hw.simulators.laws import BRISTLES, FRICTION, GAP, HARDENING, LAW_NUMBERS, RIPPLE, SOFTENING
from bayes_hw.simulators.linear_axis import LinearSystem

LOOSE, STIFF = 0.9, 0.95
"""Of MuJoCo's default solimp: impedance where a friction constraint stands, and its largest."""


FIRSTS = (("motor", S.MOTOR_FRICTION, S.RIPPLE), ("load", S.LOAD_FRICTION, S.LOAD_RIPPLE))
"""Doors, with the first of their settings of friction and of ripple."""


@dataclass(frozen=True)
class DoorPlace:
    """A door's element, its number among the doors, output units a unit of the model, and the force in the
    model's units that accelerates it by one output unit per s^2."""

    kind: str
    name: str
    index: int
    scale: float
    inertia: float


@dataclass(frozen=True)
class DoorForces:
    """Numbers to be set in the model, and laws (laws, LAW_NUMBERS) of `axis_loop`."""

    edits: list[Edit]
    laws: FloatArray


def friction_time_at(acceleration: float, time: float) -> float:
    """The speed below which MuJoCo's frictionloss fades, for its acceleration and time constant.

    A friction constraint of impedance d with reference acceleration -b v, b = 2 / (d_max time), is a force
    d (-b v - a) over the inertia, until it reaches frictionloss: what pushes with it creeps at
    (1 - d) / (d b) times its acceleration (MuJoCo, Computation, "Constraint model").
    """
    return acceleration * (1 - LOOSE) / LOOSE * 0.5 * STIFF * time


def doors_forces(
    model: Any, settings: FloatArray, places: Mapping[str, DoorPlace], system: LinearSystem, has_cubic: bool
) -> DoorForces:
    """The forces of settings (COUNT,) at `places` of a model whose linear system is `system`."""
    edits: list[Edit] = []
    laws: list[list[float]] = []
    for name, friction, wave in FIRSTS:
        if name not in places:
            continue
        own_edits, own_laws = _friction(model, settings, places[name], friction, system.step_s)
        edits += own_edits
        laws += own_laws
        laws += _waves(settings, wave, places[name])
    laws += _meshed(settings, places, system)
    if "compliance" in places:
        own_edits, own_laws = _spring(model, settings, places["compliance"], system.stiffness, has_cubic)
        edits += own_edits
        laws += own_laws
    return DoorForces(edits, _rows(laws))


def door_laws(settings: FloatArray, places: Mapping[str, DoorPlace], system: LinearSystem) -> FloatArray:
    """The forces of settings (COUNT,) at motor and load as laws (laws, LAW_NUMBERS), without means of a
    model's own."""
    laws: list[list[float]] = []
    for name, friction, wave in FIRSTS:
        if name in places:
            laws += _friction(None, settings, places[name], friction, system.step_s)[1]
            laws += _waves(settings, wave, places[name])
    laws += _meshed(settings, places, system)
    return _rows(laws)


def _rows(laws: list[list[float]]) -> FloatArray:
    rows = np.zeros((len(laws), LAW_NUMBERS))
    for row, law in zip(rows, laws, strict=True):
        row[: len(law)] = law
    return rows


def _waves(settings: FloatArray, first: int, place: DoorPlace) -> list[list[float]]:
    """Ripple at a door, where there is any."""
    if settings[first] == 0 and settings[first + 5] == 0:
        return []
    return [_ripple(settings, first, place.index, place, place.inertia)]


def _meshed(settings: FloatArray, places: Mapping[str, DoorPlace], system: LinearSystem) -> list[list[float]]:
    """Ripple of the gear mesh at the motor, and its reaction, where there is any."""
    if settings[S.MESH_RIPPLE] == 0 and settings[S.MESH_RIPPLE_START] == 0:
        return []
    motor, load = places["motor"], places["load"]
    return [
        _ripple(settings, S.MESH_RIPPLE, motor.index, motor, -motor.inertia * system.reaction),
        _meshed_load(settings, load, motor),
    ]


def _friction(
    model: Any, s: FloatArray, place: DoorPlace, first: int, step_s: float
) -> tuple[list[Edit], list[list[float]]]:
    """Dry friction by frictionloss where there is a `model` of MuJoCo, and where it neither falls with speed,
    bends nor depends on the direction."""
    level, static, slow, smoothing, presliding = s[first : first + 5].tolist()
    at_motor = first == S.MOTOR_FRICTION
    viscous, viscous_asymmetry, asymmetry = (
        (float(s[S.VISCOUS]), float(s[S.VISCOUS_ASYMMETRY]), float(s[S.MOTOR_ASYMMETRY]))
        if at_motor
        else (0.0, 0.0, 0.0)
    )
    if level == 0 and viscous == 0:
        return [], []
    force, damping = level * place.inertia, viscous * place.inertia * place.scale
    response = 1 / (place.inertia * place.scale)
    if presliding > 0:
        law = [BRISTLES, place.index, force, static, slow / place.scale]
        return [], [[*law, presliding * place.inertia * place.scale, 0.0, 0.0, 0.0, response]]
    if model is not None and static == 0 and asymmetry == 0 and viscous_asymmetry == 0:
        joint = model.joint(place.name)
        edits = [Edit("joint", place.name, "frictionloss", float(joint.frictionloss[0]) + force)]
        if level > 0:
            time = max(smoothing / friction_time_at(level, 1.0), 2 * step_s)
            edits.append(Edit("joint", place.name, FRICTION_TIME, time))
        if damping > 0:
            edits.append(Edit("joint", place.name, "damping", float(joint.damping[0]) + damping))
        return edits, []
    numbers = [force, static, slow / place.scale, smoothing / place.scale, asymmetry]
    return [], [[FRICTION, place.index, *numbers, damping, viscous_asymmetry, response]]


def _ripple(s: FloatArray, first: int, index: int, place: DoorPlace, force: float) -> list[float]:
    """A wave of settings as a law; `force` is the model's force a unit of acceleration."""
    size, period, phase, second, second_phase, constant = s[first : first + 6].tolist()
    sizes = [force * size, period / place.scale, phase, force * second, second_phase, force * constant]
    return [RIPPLE, index, *sizes]


def _meshed_load(s: FloatArray, load: DoorPlace, motor: DoorPlace) -> list[float]:
    """The ripple of the gear mesh on the load, periodic in the motor's position."""
    law = _ripple(s, S.MESH_RIPPLE, load.index, motor, load.inertia)
    return [*law, 0.0, 0.0, 1.0 + motor.index]


def _spring(
    model: Any, s: FloatArray, place: DoorPlace, stiffness: float, has_cubic: bool
) -> tuple[list[Edit], list[list[float]]]:
    """A gap by the slack of a tendon, a cubic spring by its polynomial; what else there is as laws."""
    edits: list[Edit] = []
    laws: list[list[float]] = []
    gap, bent = float(s[S.GAP]) / place.scale, place.scale**2
    if gap > 0 and place.kind == "tendon":
        low, high = model.tendon_lengthspring[model.tendon(place.name).id].tolist()
        edits.append(Edit("tendon", place.name, SPRING_BAND, 0.5 * (high - low) + gap))
    elif gap > 0:
        laws.append([GAP, place.index, stiffness, gap])
    if s[S.SOFTENING] != 0:
        laws.append([SOFTENING, place.index, stiffness, float(s[S.SOFTENING]) * bent])
    elif s[S.CUBIC] != 0 and has_cubic:
        edits.append(Edit(place.kind, place.name, CUBIC, stiffness * float(s[S.CUBIC]) * bent))
    elif s[S.CUBIC] != 0:
        laws.append([HARDENING, place.index, stiffness, float(s[S.CUBIC]) * bent])
    return edits, laws
