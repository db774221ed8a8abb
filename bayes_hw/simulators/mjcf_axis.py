"""An axis in a MuJoCo model (MJCF or URDF): its parameters, its doors, its linear system, and its motion."""

from __future__ import annotations

import copy
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.gap.case.simulator import Force, command_of
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.gap.simulate import settings as S  # noqa: N812
from bayes_hw.model.parameters import Parameter
from bayes_hw.model.priors import Logarithm, LogNormal
from bayes_hw.simulators.declaration import Declaration, Door
from bayes_hw.simulators.door_forces import DoorForces, DoorPlace, doors_forces, friction_time_at
from bayes_hw.simulators.edits import Edit, identifier, package, set_in_model, value_in
from bayes_hw.simulators.linear_axis import LinearSystem
from bayes_hw.simulators.linear_kernel import COMPLIANCE, LOAD, MOTOR
from bayes_hw.simulators.stepped_axis import SteppedAxis

DIFFERENCE = 1e-6
"""Step of the derivatives of a physics step, in the model's own units."""

PLACES = {"motor": MOTOR, "load": LOAD, "compliance": COMPLIANCE}


@dataclass(frozen=True)
class Place:
    """Where a door stands in the model: position P q - rest and speed J v in the model's units, both linear.

    `kind` and `name` are those of its joint or tendon; `stiffness` that of its spring, `band` half the length
    that the spring is slack for.
    """

    kind: str
    name: str
    position: FloatArray
    speed: FloatArray
    rest: float
    ratio: float


class MjcfAxis(SteppedAxis):
    """A `SimulatorWithDoors` that is a MuJoCo model; commands, outputs and forces in the record's units.

    Raises InputError where MuJoCo cannot read the file, where the declaration names what is not there, and
    where the record's rate is no whole part of that of the physics.
    """

    def __init__(self, path: Path, declaration: Declaration, jobs: int = 1) -> None:
        super().__init__(path, declaration)
        self.jobs = jobs
        self.mujoco: ModuleType = package()
        try:
            self.description = self.mujoco.MjSpec.from_file(str(path))
            self.model = self.description.compile()
        except (ValueError, OSError) as error:
            said = " ".join(str(error).split())
            raise InputError(f"{path}: MuJoCo cannot read it ({said}); give an MJCF or URDF file") from None
        steps = 1 / (self.sample_rate_hz * float(self.model.opt.timestep))
        self.substeps = round(steps)
        if self.substeps < 1 or abs(steps / self.substeps - 1) > 1e-6:
            raise InputError(
                f"{path}: timestep {self.model.opt.timestep:g} s is no whole part of a sample at "
                f"{self.sample_rate_hz:g} Hz; set another timestep, or resample the records"
            )
        self.read = self._reading()
        self.actuators = [
            identifier(self.mujoco, self.model, "actuator", name, f"{declaration.path}: command.actuators")
            for name in declaration.actuators
        ]
        self.places: dict[str, Place] = {door.name: self._place(door) for door in declaration.doors}
        self.parameters: tuple[Parameter, ...] = tuple(self._parameters())

    def _joint(self, name: str, where: str) -> int:
        index = identifier(self.mujoco, self.model, "joint", name, f"{self.declaration.path}: {where}")
        if not self._is_scalar(index):
            raise InputError(f"{self.declaration.path}: {where}: {name!r} is no hinge or slide; give one")
        return index

    def _is_scalar(self, joint: int) -> bool:
        """Whether a joint is a hinge or a slide."""
        kinds = self.mujoco.mjtJoint
        return int(self.model.jnt_type[joint]) in (int(kinds.mjJNT_HINGE), int(kinds.mjJNT_SLIDE))

    def _reading(self) -> tuple[int, int]:
        """Whether a sensor is read, and where the output stands among positions or sensors."""
        (kind, name), *_ = self.declaration.measured.items()
        if kind == "joint":
            return 0, int(self.model.jnt_qposadr[self._joint(name, "measured.joint")])
        if kind == "sensor":
            where = f"{self.declaration.path}: measured.sensor"
            return 1, int(self.model.sensor_adr[identifier(self.mujoco, self.model, "sensor", name, where)])
        raise InputError(f"{self.declaration.path}: measured.variable is for an FMU; give joint or sensor")

    def _unit_vectors(self, joint: int) -> tuple[FloatArray, FloatArray]:
        position, speed = np.zeros(self.model.nq), np.zeros(self.model.nv)
        position[self.model.jnt_qposadr[joint]] = speed[self.model.jnt_dofadr[joint]] = 1.0
        return position, speed

    def _place(self, door: Door) -> Place:
        where, model = f"forces.{door.name}", self.model
        if door.joint:
            joint = self._joint(door.joint, f"{where}.joint")
            position, speed = self._unit_vectors(joint)
            at = model.jnt_qposadr[joint]
            rest = float(model.qpos_spring[at] if door.name == "compliance" else model.qpos0[at])
            return Place("joint", door.joint, position, speed, rest, door.ratio)
        if door.name != "compliance" or not door.tendon:
            raise InputError(f"{self.declaration.path}: {where}: give its joint")
        label = f"{self.declaration.path}: {where}.tendon"
        tendon = identifier(self.mujoco, model, "tendon", door.tendon, label)
        position, speed = np.zeros(model.nq), np.zeros(model.nv)
        first = int(model.tendon_adr[tendon])
        for wrap in range(first, first + int(model.tendon_num[tendon])):
            if int(model.wrap_type[wrap]) != int(self.mujoco.mjtWrap.mjWRAP_JOINT):
                raise InputError(f"{label}: {door.tendon!r} is spatial; give a fixed tendon or a joint")
            one, other = self._unit_vectors(int(model.wrap_objid[wrap]))
            position += model.wrap_prm[wrap] * one
            speed += model.wrap_prm[wrap] * other
        rest = float(np.mean(model.tendon_lengthspring[tendon]))
        return Place("tendon", door.tendon, position, speed, rest, door.ratio)

    def _parameters(self) -> list[Parameter]:
        found = []
        for uncertain in self.declaration.uncertain:
            where = f"{self.declaration.path}: uncertain.parameter {uncertain.parameter!r}"
            parts = uncertain.parameter.split("/")
            if len(parts) != 3:
                raise InputError(f"{where}: give KIND/NAME/FIELD, such as joint/motor/armature")
            nominal = value_in(self.mujoco, self.model, parts[0], parts[1], parts[2], where)
            if not nominal > 0:
                raise InputError(
                    f"{where}: is {nominal:g} in the model; give it a positive value there, about which "
                    "relative_sd can spread"
                )
            prior = LogNormal(nominal, uncertain.relative_sd)
            found.append(Parameter(uncertain.parameter, "", nominal, prior, Logarithm()))
        return found

    def base_edits(self, values: FloatArray) -> list[Edit]:
        """What parameter values (parameters,) set in the model."""
        found = []
        for parameter, value in zip(self.parameters, values.tolist(), strict=True):
            kind, name, field = parameter.name.split("/")
            found.append(Edit(kind, name, field, value))
        return found

    def with_edits(self, edits: list[Edit]) -> Any:
        """A compiled model of its own with `edits`."""
        model = copy.copy(self.model)
        set_in_model(self.mujoco, model, edits)
        return model

    @property
    def doors(self) -> frozenset[str]:
        """Those that it has."""
        return frozenset(self.places)

    @cached_property
    def limits(self) -> tuple[float, float]:
        """Commands, in the record's units, that all the actuators take."""
        low, high = -np.inf, np.inf
        for index in self.actuators if self.declaration.loop is None else ():
            if self.model.actuator_ctrllimited[index]:
                low = max(low, float(self.model.actuator_ctrlrange[index, 0]))
                high = min(high, float(self.model.actuator_ctrlrange[index, 1]))
        return low / self.declaration.input_factor, high / self.declaration.input_factor

    def linearised(self, values: FloatArray) -> LinearSystem:
        """The linear system at parameter values (parameters,), by differences of physics steps."""
        model = self.with_edits(self.base_edits(values))
        own_friction = model.dof_frictionloss.copy()
        model.dof_frictionloss[:] = 0.0
        bands = model.tendon_lengthspring.copy()
        if model.ntendon:
            model.tendon_lengthspring[:] = np.mean(bands, axis=1, keepdims=True)
        data, nv, na = self.mujoco.MjData(model), int(model.nv), int(model.na)
        count = 2 * nv + na
        a, b = np.zeros((count, count)), np.zeros((count, model.nu))
        c, d = np.zeros((model.nsensordata, count)), np.zeros((model.nsensordata, model.nu))
        self.mujoco.mj_forward(model, data)
        self.mujoco.mjd_transitionFD(model, data, DIFFERENCE, True, a, b, c, d)
        forces = {n: self._pushed(model, data, place.speed, count) for n, place in self.places.items()}
        constant = self._stepped(model, data, np.zeros(nv), count)
        factor = self.declaration.output_factor
        shown = np.zeros(count)
        if self.read[0]:
            shown = factor * c[self.read[1]]
        else:
            shown[:nv] = factor * self._tangent(self.read[1])
        entering = b[:, self.actuators].sum(axis=1) if self.actuators else np.zeros(count)
        step = float(model.opt.timestep)
        a, entering, constant, shown, forces = self._with_loop(model, a, entering, constant, shown, forces)
        size = len(entering)
        positions, speeds, columns = (np.zeros((3, size)) for _ in range(3))
        rests, own, inertia, stiffness = np.zeros(3), np.zeros(5), np.ones(2), 0.0
        for name, place in self.places.items():
            door, scale = PLACES[name], factor / place.ratio
            tangent = self._tangent_of(place.position)
            positions[door, :nv] = scale * tangent
            speeds[door, nv : 2 * nv] = scale * place.speed
            rests[door] = scale * (place.rest - float(place.position @ model.qpos0))
            if door == COMPLIANCE:
                stiffness = self.stiffness_of(model, place)
                columns[door] = forces[name] * stiffness / scale
                if place.kind == "tendon":
                    own[4] = 0.5 * scale * float(np.ptp(bands[model.tendon(place.name).id]))
                continue
            response = float(speeds[door] @ forces[name]) / step
            inertia[door] = 1 / response
            columns[door] = forces[name] * inertia[door]
            dof = int(np.argmax(np.abs(place.speed)))
            level = float(own_friction[dof]) / inertia[door]
            time = float(model.dof_solref[dof, 0])
            own[2 * door] = level
            own[2 * door + 1] = max(level * friction_time_at(1.0, time), 1e-12)
        reaction = 0.0
        if {"motor", "load"} <= self.doors:
            ratios = self.places["load"].ratio / self.places["motor"].ratio
            reaction = float(inertia[LOAD] / inertia[MOTOR] * ratios)
        return LinearSystem(
            np.ascontiguousarray(a),
            entering * self.declaration.input_factor,
            constant,
            shown,
            0.0,
            step,
            positions,
            speeds,
            columns,
            rests,
            reaction,
            own,
            inertia,
            stiffness,
        )

    def _with_loop(
        self,
        model: Any,
        a: FloatArray,
        entering: FloatArray,
        constant: FloatArray,
        shown: FloatArray,
        forces: dict[str, FloatArray],
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, dict[str, FloatArray]]:
        """The system of `model` closed by the declared loop, whose integral is a state more; no limit."""
        loop = self.declaration.loop
        if loop is None:
            return a, entering, constant, shown, forces
        count, nv = len(entering), int(self.model.nv)
        if not self.actuators:
            entering = self._pushed(model, self.mujoco.MjData(model), self.loop_torque, count)
        measured, step = np.zeros(count), float(model.opt.timestep)
        measured[nv : 2 * nv] = self.loop_speed
        closed = np.zeros((count + 1, count + 1))
        closed[:count, :count] = a - loop.proportional * np.outer(entering, measured)
        closed[:count, count] = loop.integral * entering
        closed[count, :count] = -step * measured
        closed[count, count] = 1.0
        return (
            closed,
            np.append(loop.proportional * entering, step),
            np.append(constant, 0.0),
            np.append(shown, 0.0),
            {name: np.append(column, 0.0) for name, column in forces.items()},
        )

    @property
    def loop_numbers(self) -> list[float]:
        """Gains and limit of the declared loop, and whether there is one."""
        loop = self.declaration.loop
        if loop is None:
            return [0.0] * 4
        return [loop.proportional, loop.integral, min(loop.limit, sys.float_info.max), 1.0]

    @cached_property
    def loop_speed(self) -> FloatArray:
        """The speed that the declared loop measures, along it; zero without one."""
        loop = self.declaration.loop
        if loop is None:
            return np.zeros(self.model.nv)
        return self._unit_vectors(self._joint(loop.speed_of, "loop.speed_of"))[1]

    @cached_property
    def loop_torque(self) -> FloatArray:
        """The force of the declared loop where no actuator takes it."""
        loop = self.declaration.loop
        if loop is None or not loop.torque_on:
            return np.zeros(self.model.nv)
        return self._unit_vectors(self._joint(loop.torque_on, "loop.torque_on"))[1]

    def _tangent(self, address: int) -> FloatArray:
        position = np.zeros(self.model.nq)
        position[address] = 1.0
        return self._tangent_of(position)

    def _tangent_of(self, position: FloatArray) -> FloatArray:
        """A row of hinge and slide positions as one of speeds."""
        found = np.zeros(self.model.nv)
        for joint in range(self.model.njnt):
            if self._is_scalar(joint):
                found[self.model.jnt_dofadr[joint]] = position[self.model.jnt_qposadr[joint]]
        return found

    def _stepped(self, model: Any, data: Any, force: FloatArray, count: int) -> FloatArray:
        """State (count,) after one step from rest under a generalised force (nv,), in `data` of the model."""
        nv = int(model.nv)
        self.mujoco.mj_resetData(model, data)
        data.qfrc_applied[:] = force
        self.mujoco.mj_step(model, data)
        state = np.zeros(count)
        self.mujoco.mj_differentiatePos(model, state[:nv], 1.0, model.qpos0, data.qpos)
        state[nv : 2 * nv], state[2 * nv :] = data.qvel, data.act
        return state

    def _pushed(self, model: Any, data: Any, along: FloatArray, count: int) -> FloatArray:
        """Change of the state in a step by a unit force along a door."""
        up, down = (self._stepped(model, data, side * along, count) for side in (1.0, -1.0))
        return 0.5 * (up - down)

    def stiffness_of(self, model: Any, place: Place) -> float:
        """Of a compliance's spring in `model`, in its units."""
        if place.kind == "tendon":
            return float(model.tendon_stiffness[model.tendon(place.name).id])
        return float(model.jnt_stiffness[model.joint(place.name).id])

    def forces_of(self, values: FloatArray, settings: FloatArray) -> DoorForces:
        """What settings (COUNT,) are in the model at parameter values (parameters,): by its own means, and as
        laws for what it has none for."""
        system = self.linear.system(values)
        factor = self.declaration.output_factor
        places = {
            name: DoorPlace(
                place.kind,
                place.name,
                index,
                factor / place.ratio,
                float(system.inertia[PLACES[name]]) if PLACES[name] != COMPLIANCE else 0.0,
            )
            for index, (name, place) in enumerate(self.places.items())
        }
        return doors_forces(self.model, settings, places, system, hasattr(self.model, "tendon_stiffnesspoly"))

    def motion(
        self, model: Any, command: FloatArray, laws: FloatArray, known: FloatArray | None = None
    ) -> FloatArray:
        """Output (samples,) of a compiled `model` for a command (samples,), both in the record's units."""
        from bayes_hw.simulators.axis_loop import run

        places = list(self.places.values())
        doors = (
            np.array([place.position for place in places]).reshape(len(places), self.model.nq),
            np.array([place.speed for place in places]).reshape(len(places), self.model.nv),
            np.array([place.rest for place in places]),
        )
        y = run(
            model,
            command * self.declaration.input_factor,
            self.substeps,
            self.actuators,
            self.loop_numbers,
            self.loop_speed,
            self.loop_torque,
            doors,
            laws,
            self.read,
            known,
        )
        return np.asarray((y - y[0]) * self.declaration.output_factor)

    def write_corrected(self, diagnosis: Diagnosis, folder: Path, rng: np.random.Generator) -> None:
        """See `corrected_mjcf`."""
        from bayes_hw.simulators.corrected_mjcf import write_corrected

        write_corrected(self, diagnosis, folder, rng)

    def simulate(self, values: FloatArray, inputs: FloatArray, force: Force | None = None) -> FloatArray:
        """Outputs (batch, samples) for values (batch, parameters) and inputs as `LinearAxis` takes them."""
        settings = np.tile(S.NEUTRAL, (len(values), 1)) if force is None else force.settings
        signal = None if force is None else force.signal

        def one(row: int) -> FloatArray:
            found = self.forces_of(values[row], settings[row])
            model = self.with_edits([*self.base_edits(values[row]), *found.edits])
            known = self.forces_at(list(self.places), values[row], inputs, signal)
            return self.motion(model, command_of(inputs), found.laws, known)

        if self.jobs == 1 or len(values) == 1:
            return np.array([one(row) for row in range(len(values))])
        with ThreadPoolExecutor(self.jobs) as pool:
            return np.array(list(pool.map(one, range(len(values)))))
