"""Numbers of a MuJoCo model that are set: in the compiled model, and in what it is written from."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

from bayes_hw.errors import InputError

FIELDS = {
    "joint": ("armature", "damping", "stiffness", "frictionloss"),
    "tendon": ("stiffness", "damping"),
    "actuator": ("gain",),
    "body": ("mass",),
}
"""What may be uncertain, by the kind of element."""

FRICTION_TIME, SPRING_BAND, CUBIC = "friction_time", "spring_band", "cubic"
"""Fields that effects set beside those."""


@dataclass(frozen=True)
class Edit:
    """A number of a named element: joint, tendon, actuator or body.

    `gain` and `mass` are factors on what the file gives: a gain's bias scales with it, a mass's inertia.
    `friction_time` is the time constant of a joint's frictionloss, `spring_band` half the length that a
    tendon's spring is slack for, about the middle of what it has, `cubic` the coefficient of x^3 in a
    spring's force.
    """

    kind: str
    name: str
    field: str
    value: float


def package(option: str = "--simulator") -> ModuleType:
    """MuJoCo; raises InputError where it is not installed."""
    try:
        import mujoco
    except ImportError:
        raise InputError(f"{option}: MuJoCo is not installed; pip install bayes-hw[mujoco]") from None
    return mujoco


def identifier(mujoco: ModuleType, model: Any, kind: str, name: str, where: str) -> int:
    """The number of a named element; raises InputError where there is none, and names those there are."""
    kinds = {"joint": "JOINT", "tendon": "TENDON", "actuator": "ACTUATOR", "body": "BODY", "sensor": "SENSOR"}
    if kind not in kinds:
        raise InputError(f"{where}: {kind!r} is no kind of element; use one of {', '.join(FIELDS)}")
    of = getattr(mujoco.mjtObj, f"mjOBJ_{kinds[kind]}")
    found = int(mujoco.mj_name2id(model, of, name))
    if found < 0:
        count = {"joint": model.njnt, "tendon": model.ntendon, "actuator": model.nu, "body": model.nbody}
        number = count.get(kind, model.nsensor)
        names = [mujoco.mj_id2name(model, of, i) for i in range(number)]
        known = ", ".join(name for name in names if name) or "none has a name"
        raise InputError(f"{where}: no {kind} {name!r} in the model; it has: {known}")
    return found


def value_in(mujoco: ModuleType, model: Any, kind: str, name: str, field: str, where: str) -> float:
    """What the compiled model holds; of a gain or a mass the factor 1. Raises InputError where unknown."""
    index = identifier(mujoco, model, kind, name, where)
    if field not in FIELDS.get(kind, ()):
        raise InputError(f"{where}: {field!r} of a {kind} is unknown; use {', '.join(FIELDS[kind])}")
    if field in ("gain", "mass"):
        return 1.0
    array = getattr(model, _array(kind, field))
    return float(array[_row(model, kind, field, index)])


def _array(kind: str, field: str) -> str:
    if kind == "tendon":
        return f"tendon_{field}"
    return "jnt_stiffness" if field == "stiffness" else f"dof_{field}"


def _row(model: Any, kind: str, field: str, index: int) -> int:
    return index if kind == "tendon" or field == "stiffness" else int(model.jnt_dofadr[index])


def set_in_model(mujoco: ModuleType, model: Any, edits: list[Edit]) -> None:
    """Set numbers of a compiled model, and what follows from them."""
    for edit in edits:
        index = identifier(mujoco, model, edit.kind, edit.name, edit.name)
        if edit.field == "gain":
            model.actuator_gainprm[index] *= edit.value
            model.actuator_biasprm[index] *= edit.value
        elif edit.field == "mass":
            model.body_mass[index] *= edit.value
            model.body_inertia[index] *= edit.value
        elif edit.field == FRICTION_TIME:
            model.dof_solref[int(model.jnt_dofadr[index])] = edit.value, 1.0
        elif edit.field == SPRING_BAND:
            middle = float(model.tendon_lengthspring[index].mean())
            model.tendon_lengthspring[index] = middle - edit.value, middle + edit.value
        elif edit.field == CUBIC:
            poly = model.tendon_stiffnesspoly if edit.kind == "tendon" else model.jnt_stiffnesspoly
            poly[index, 1] = edit.value
        else:
            array = getattr(model, _array(edit.kind, edit.field))
            array[_row(model, edit.kind, edit.field, index)] = edit.value
    mujoco.mj_setConst(model, mujoco.MjData(model))


def set_in_description(spec: Any, model: Any, edits: list[Edit]) -> None:
    """The same in a description (MjSpec) of which `model` was compiled."""
    for edit in edits:
        element = getattr(spec, edit.kind)(edit.name)
        if edit.field == "gain":
            element.gainprm = [number * edit.value for number in element.gainprm]
            element.biasprm = [number * edit.value for number in element.biasprm]
        elif edit.field == "mass":
            body = model.body(edit.name)
            element.explicitinertial = True
            element.mass = float(body.mass[0]) * edit.value
            element.inertia = body.inertia * edit.value
            element.ipos, element.iquat = body.ipos, body.iquat
        elif edit.field == FRICTION_TIME:
            element.solref_friction = [edit.value, 1.0]
        elif edit.field == SPRING_BAND:
            middle = float(model.tendon_lengthspring[model.tendon(edit.name).id].mean())
            element.springlength = [middle - edit.value, middle + edit.value]
        elif edit.field == CUBIC:
            element.stiffness = [element.stiffness[0], element.stiffness[1], edit.value]
        elif edit.field in ("stiffness", "damping") and hasattr(getattr(element, edit.field), "__len__"):
            before = getattr(element, edit.field)
            setattr(element, edit.field, [edit.value, *list(before)[1:]])
        else:
            setattr(element, edit.field, edit.value)
