"""An axis linearised about its rest, with its own parameters and the forces of the catalogue at its doors.

A search for the missing effect simulates an axis thousands of times. Linearised it takes milliseconds; the
full simulator is then asked where it matters, and the linear one moved by what it lacks (`recentring`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.simulator import Force, command_of
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.gap.simulate.lru_cache import LruCache
from bayes_hw.model.parameters import Parameter
from bayes_hw.simulators.declaration import FORCE_DOORS, KnownForce
from bayes_hw.simulators.linear_kernel import COMPLIANCE, LOAD, MOTOR, move_freely, move_with_forces
from bayes_hw.units import Units

AT_MOTOR = frozenset(
    {
        *(S.MOTOR_FRICTION, S.MOTOR_STATIC, S.MOTOR_STRIBECK_SPEED, S.MOTOR_SMOOTHING, S.MOTOR_PRESLIDING),
        *(S.MOTOR_ASYMMETRY, S.VISCOUS, S.VISCOUS_ASYMMETRY),
        *range(S.RIPPLE, S.RIPPLE_START + 1),
    }
)
AT_LOAD = frozenset(
    {
        *(S.LOAD_FRICTION, S.LOAD_STATIC, S.LOAD_STRIBECK_SPEED, S.LOAD_SMOOTHING, S.LOAD_PRESLIDING),
        *range(S.LOAD_RIPPLE, S.LOAD_RIPPLE_START + 1),
    }
)
AT_BOTH = frozenset(range(S.MESH_RIPPLE, S.MESH_RIPPLE_START + 1))
AT_COMPLIANCE = frozenset({S.CUBIC, S.SOFTENING, S.GAP})
"""Settings by the door that they need; ripple of the gear mesh needs motor and load."""


@dataclass(frozen=True)
class LinearSystem:
    """x' = A x + b u + c, y = s x + offset in steps of h, u and y in the record's units, and the doors.

    `positions`, `speeds` and `columns` (3, states), `rests` (3,), `reaction` and `own` (5,) as in
    `linear_kernel.move_with_forces`, zero where there is no such door. `inertia` (2,) is the force, in the
    simulator's units, that a unit of acceleration in output units takes at motor and load; `stiffness` the
    compliance's own.
    """

    transition: FloatArray
    entering: FloatArray
    constant: FloatArray
    shown: FloatArray
    offset: float
    step_s: float
    positions: FloatArray
    speeds: FloatArray
    columns: FloatArray
    rests: FloatArray
    reaction: float
    own: FloatArray
    inertia: FloatArray
    stiffness: float

    def a_sample(self, substeps: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """A, b and c of `substeps` steps in one, the command held."""
        count = len(self.entering)
        whole = np.eye(count + 2)
        whole[:count] = np.column_stack([self.transition, self.entering, self.constant])
        powered = np.linalg.matrix_power(whole, substeps)
        return (
            np.ascontiguousarray(powered[:count, :count]),
            np.ascontiguousarray(powered[:count, count]),
            np.ascontiguousarray(powered[:count, count + 1]),
        )


@dataclass(frozen=True, eq=False)
class LinearAxis:
    """A `SimulatorWithDoors` by the linear systems (`linearised`) of an axis at its parameter values
    (parameters,); `doors` names those that it has, `limits` the commands that it takes, in record units."""

    name: str
    parameters: tuple[Parameter, ...]
    sample_rate_hz: float
    units: Units
    noise_sigma: float
    substeps: int
    doors: frozenset[str]
    limits: tuple[float, float]
    linearised: Callable[[FloatArray], LinearSystem]
    known_forces: tuple[KnownForce, ...] = ()
    known: LruCache[bytes, LinearSystem] = field(default_factory=lambda: LruCache(KEPT))

    @property
    def known_inputs(self) -> tuple[str, ...]:
        """Columns of the records that enter as forces."""
        return tuple(force.column for force in self.known_forces)

    @property
    def force_door(self) -> bool:
        """Whether a known force can be added at the motor."""
        return "motor" in self.doors

    @property
    def obeyed(self) -> frozenset[int]:
        """Settings of forces within the axis that it takes."""
        both = {"motor", "load"} <= self.doors
        found: frozenset[int] = frozenset()
        for there, settings in (
            ("motor" in self.doors, AT_MOTOR),
            ("load" in self.doors, AT_LOAD),
            (both, AT_BOTH),
            ("compliance" in self.doors, AT_COMPLIANCE),
        ):
            found |= settings if there else frozenset()
        return found

    def system(self, values: FloatArray) -> LinearSystem:
        """At parameter values (parameters,)."""
        key = np.ascontiguousarray(values, np.float64).tobytes()
        found = self.known[key]
        if found is None:
            self.known[key] = found = self.linearised(values)
        return found

    @cached_property
    def stiffness(self) -> tuple[float, float]:
        """Accelerations at motor (a quarter of it) and load that move the output by one unit at most."""
        values = np.array([parameter.nominal for parameter in self.parameters])
        system = self.system(values)
        samples = round(RESPONSE_S * self.sample_rate_hz)
        found = []
        for door in (MOTOR, LOAD):
            if not np.any(system.columns[door]):
                found.append(np.nan)
                continue
            y = np.empty(samples * self.substeps)
            move_freely(
                system.transition,
                system.columns[door],
                np.zeros_like(system.constant),
                system.shown,
                0.0,
                np.ones(len(y)),
                y,
            )
            found.append(1 / float(np.max(np.abs(y))))
        motor, load = found
        motor, load = (load if np.isnan(motor) else motor), (motor if np.isnan(load) else load)
        return (0.25 * motor, load)

    def simulate(self, values: FloatArray, inputs: FloatArray, force: Force | None = None) -> FloatArray:
        """Outputs (batch, samples) for values (batch, parameters) and inputs (samples,), with known forces
        (samples, columns), in the records' units."""
        settings = np.tile(S.NEUTRAL, (len(values), 1)) if force is None else force.settings
        signal = None if force is None else force.signal
        inner = sorted(self.obeyed & INNER)
        command = np.clip(command_of(inputs), *self.limits)
        outputs = np.empty((len(values), len(command)))
        for row, at in enumerate(values):
            system = self.system(np.ascontiguousarray(at, np.float64))
            moved = bool(np.any(settings[row, inner] != S.NEUTRAL[inner])) or bool(np.any(system.own))
            known = self._accelerations(system, inputs, signal)
            if not moved and not known.any():
                freely = system.a_sample(self.substeps)
                move_freely(*freely, system.shown, system.offset, command, outputs[row])
                continue
            move_with_forces(
                system.transition,
                system.entering,
                system.constant,
                system.shown,
                system.offset,
                command,
                self.substeps,
                system.step_s,
                system.positions,
                system.speeds,
                system.columns,
                system.rests,
                system.reaction,
                system.own,
                settings[row].copy(),
                known,
                outputs[row],
            )
        return outputs

    def _accelerations(
        self, system: LinearSystem, inputs: FloatArray, signal: FloatArray | None
    ) -> FloatArray:
        """Known ones (samples, 2) at motor and load: the inputs' columns, and a `signal` at the motor."""
        found = np.zeros((len(inputs), len(FORCE_DOORS)))
        for column, force in enumerate(self.known_forces, start=1):
            door = FORCE_DOORS.index(force.door)
            found[:, door] += force.factor / system.inertia[door] * inputs[:, column]
        if signal is not None:
            found[:, MOTOR] += signal
        return found


KEPT = 2048
"""Linear systems kept: a search asks again for many."""

RESPONSE_S = 5.0
"""Time within which the response to a constant force is greatest."""

INNER = frozenset(
    {
        *(S.MOTOR_FRICTION, S.VISCOUS, S.LOAD_FRICTION, S.CUBIC, S.SOFTENING, S.GAP),
        *(S.RIPPLE, S.RIPPLE_START, S.LOAD_RIPPLE, S.LOAD_RIPPLE_START, S.MESH_RIPPLE, S.MESH_RIPPLE_START),
    }
)
"""Settings that stand for a force wherever they are not neutral."""

__all__ = ["COMPLIANCE", "LOAD", "MOTOR", "LinearAxis", "LinearSystem"]
