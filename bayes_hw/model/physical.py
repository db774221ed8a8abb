"""What the owner of an axis knows of its mechanics: "physical" of model.json, its loop closed.

Either a state space x' = A x + B (torques on motor and load), or masses and springs with a velocity loop at
the motor, torque = kp (v - speed) + ki (integral of v less the angle). SI units, all angles seen from one
side of the gear.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError

ANGLES = ("sensor", "motor", "load")


@dataclass(frozen=True, eq=False)
class Physical:
    """`a` (n, n); `torques` (n, 2): what a torque of 1 N m on motor and load adds to x'; the rows (n,) that
    show the angles (rad) of sensor, motor and load. `inertias` (kg m^2) are those of motor and load,
    `stiffness` (N m/rad) and `damping` (N m s/rad) of the gear's spring between them. `content` is as it was
    read."""

    a: FloatArray
    torques: FloatArray
    sensor: FloatArray
    motor: FloatArray
    load: FloatArray
    inertias: tuple[float, float]
    stiffness: float
    damping: float
    content: Mapping[str, Any]

    @classmethod
    def from_dict(cls, data: Any) -> Physical:
        """Of the content of "physical"; raises InputError naming the key."""
        if not isinstance(data, Mapping):
            raise InputError("physical: must be an object with A, B, ... or inertias, springs, ...")
        return _of_states(data) if "A" in data else _of_masses(data)


def _of_states(data: Mapping[str, Any]) -> Physical:
    a, b = _array(data, "A", 2), _array(data, "B", 2)
    n = len(a)
    if a.shape != (n, n):
        raise InputError(f"physical.A: must be square; it is {a.shape[0]} by {a.shape[1]}")
    if b.shape != (n, 2):
        raise InputError(f"physical.B: must be {n} by 2, torques on motor and load")
    rows = [_array(data, key, 1) for key in ANGLES]
    for key, row in zip(ANGLES, rows, strict=True):
        if len(row) != n:
            raise InputError(f"physical.{key}: must have {n} numbers, one a state")
    inertias = _array(data, "inertias", 1)
    if len(inertias) != 2:
        raise InputError("physical.inertias: must be those of motor and load")
    stiffness, damping = (_number(data, key, positive=key == "stiffness") for key in ("stiffness", "damping"))
    _positive(inertias, "inertias")
    sensor, motor, load = rows
    return Physical(
        a, b, sensor, motor, load, (float(inertias[0]), float(inertias[1])), stiffness, damping, data
    )


def _of_masses(data: Mapping[str, Any]) -> Physical:
    inertias = _array(data, "inertias", 1)
    _positive(inertias, "inertias")
    n = len(inertias)
    bearings = _array(data, "bearings", 1) if "bearings" in data else np.zeros(n)
    if len(bearings) != n:
        raise InputError(f"physical.bearings: must have {n} numbers, one a body")
    springs = data.get("springs")
    if not isinstance(springs, list) or not all(isinstance(spring, Mapping) for spring in springs):
        raise InputError("physical.springs: must be a list of objects")
    motor, load, sensor = (_index(data, key, n) for key in ("motor", "load", "sensor"))
    stiffness, damping = np.zeros((n, n)), np.diag(bearings)
    between = {}
    for number, spring in enumerate(springs):
        where = f"springs[{number}]"
        ends = spring.get("between")
        if not isinstance(ends, list) or len(ends) != 2:
            raise InputError(f"physical.{where}.between: must be two bodies")
        one, other = (_index({where: end}, where, n) for end in ends)
        k, d = (
            _number(spring, key, f"{where}.{key}", key == "stiffness") for key in ("stiffness", "damping")
        )
        for matrix, x in ((stiffness, k), (damping, d)):
            matrix[[one, other], [one, other]] += x
            matrix[[one, other], [other, one]] -= x
        between[frozenset((one, other))] = k, d
    gear = between.get(frozenset((motor, load)))
    if gear is None:
        raise InputError("physical.springs: none is between motor and load, where the gear's spring is")
    loop = data.get("loop")
    if not isinstance(loop, Mapping):
        raise InputError("physical.loop: must be an object with kp and ki")
    kp, ki = (_number(loop, key, f"loop.{key}") for key in ("kp", "ki"))
    size = 2 * n + 1
    a = np.zeros((size, size))
    a[:n, n : 2 * n] = np.eye(n)
    a[n : 2 * n, :n], a[n : 2 * n, n : 2 * n] = -stiffness / inertias[:, None], -damping / inertias[:, None]
    a[n + motor, n + motor] -= kp / inertias[motor]
    a[n + motor, 2 * n] = ki / inertias[motor]
    a[2 * n, n + motor] = -1.0
    used = np.ones(size, dtype=bool)
    used[2 * n] = ki != 0
    b, rows = np.zeros((size, 2)), np.eye(size)
    b[n + motor, 0], b[n + load, 1] = 1 / inertias[motor], 1 / inertias[load]
    own = (float(inertias[motor]), float(inertias[load]))
    return Physical(
        a[np.ix_(used, used)],
        b[used],
        rows[sensor][used],
        rows[motor][used],
        rows[load][used],
        own,
        *gear,
        data,
    )


def _array(data: Mapping[str, Any], key: str, dimensions: int) -> FloatArray:
    try:
        found = np.array(data[key], dtype=np.float64)
    except KeyError:
        raise InputError(f"physical.{key}: is missing") from None
    except (ValueError, TypeError):
        raise InputError(f"physical.{key}: must hold numbers") from None
    if found.ndim != dimensions or not found.size or not np.isfinite(found).all():
        kind = "matrix" if dimensions == 2 else "list"
        raise InputError(f"physical.{key}: must be a {kind} of finite numbers")
    return found


def _number(data: Mapping[str, Any], key: str, where: str = "", positive: bool = False) -> float:
    where = where or key
    x = data.get(key)
    if isinstance(x, bool) or not isinstance(x, int | float) or not np.isfinite(x) or x < 0:
        raise InputError(f"physical.{where}: must be a finite number, zero or more")
    if positive and x == 0:
        raise InputError(f"physical.{where}: must be positive")
    return float(x)


def _index(data: Mapping[str, Any], key: str, count: int) -> int:
    x = data.get(key)
    if isinstance(x, bool) or not isinstance(x, int) or not 0 <= x < count:
        raise InputError(f"physical.{key}: must be the number of a body, 0 to {count - 1}")
    return x


def _positive(values: FloatArray, key: str) -> None:
    if np.any(values <= 0):
        raise InputError(f"physical.{key}: must be positive")
