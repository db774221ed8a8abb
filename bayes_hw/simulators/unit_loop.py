"""A functional mock-up unit in motion, with the forces of laws at its inputs.

Like `laws`, this module imports nothing else of bayes_hw: a corrected simulator carries its text.
"""

from __future__ import annotations

import ctypes
import shutil
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from bayes_hw.simulators.laws import forces_of


class Unit:
    """A co-simulation unit (FMI 2 or 3) that has been taken out of its file."""

    def __init__(self, path: Path | str) -> None:
        self.description = read_model_description(str(path), validate=False)
        if self.description.coSimulation is None:
            raise ValueError("is no co-simulation unit")
        self.folder = extract(str(path))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.second = self.description.fmiVersion.startswith("2")
        kind = FMU2Slave if self.second else FMU3Slave
        self.slave = kind(
            guid=self.description.guid if self.second else self.description.instantiationToken,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="axis",
        )
        self.slave.instantiate()
        self.used = False

    def close(self) -> None:
        """Let go of the unit, and of what was taken out of its file."""
        self.slave.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)

    def begin(self, values: dict[str, float]) -> None:
        """Set to its start with these parameters."""
        if self.used:
            self.slave.terminate()
            self.slave.reset()
        self.used = True
        if self.second:
            self.slave.setupExperiment(startTime=0.0)
        self.put(list(values), list(values.values()))
        self.slave.enterInitializationMode()
        self.put(list(values), list(values.values()))
        self.slave.exitInitializationMode()

    def put(self, names: list[str], values: list[float]) -> None:
        """Set variables."""
        if names:
            Ports(self, names).put(values)

    def step(self, time: float, step_s: float) -> None:
        """One step of so many seconds from a time, s."""
        if self.second:
            _checked(self.slave.dll.fmi2DoStep(self.slave.component, time, step_s, 1))
        else:
            self.slave.doStep(time, step_s)

    def run(
        self,
        values: dict[str, float],
        inputs: dict[str, Any],
        outputs: list[str],
        substeps: int,
        step_s: float,
        doors: list[tuple[str, str, str]] | None = None,
        laws: Any = None,
        known: Any = None,
        shown: Any = None,
    ) -> Any:
        """Outputs (samples, outputs) for inputs (samples,) by name, each held for `substeps` of `step_s`.

        Where `shown` (samples,) is False they are not read, and zero. `doors` are names of force input,
        position and speed; `laws` (laws, LAW_NUMBERS) and forces that are `known` (samples, doors) act there.
        """
        motion = UnitMotion(self, values, list(inputs), outputs, step_s, doors or [], laws)
        signals = np.column_stack(list(inputs.values())).tolist()
        found = np.zeros((len(signals), len(outputs)))
        for k, row in enumerate(signals):
            if shown is None or shown[k]:
                found[k] = motion.outputs()
            if known is not None:
                motion.known[:] = known[k]
            for _ in range(substeps):
                motion.step(row)
        return found


class Ports:
    """Some variables of a unit, set and read together in one call each, without FMPy's work around it."""

    def __init__(self, unit: Unit, names: list[str]) -> None:
        slave, kind = unit.slave, "Real" if unit.second else "Float64"
        prefix = "fmi2" if unit.second else "fmi3"
        count = len(names)
        self.values: Any = (ctypes.c_double * count)()
        references = (ctypes.c_uint32 * count)(*(unit.references[name] for name in names))
        more = () if unit.second else (count,)
        self._arguments = (slave.component, references, count, self.values, *more)
        self._set, self._get = (getattr(slave.dll, f"{prefix}{do}{kind}") for do in ("Set", "Get"))
        self._held: list[float] = []

    def put(self, values: list[float]) -> None:
        """Set them, where they are not as they were set last."""
        if values != self._held:
            self.values[:] = values
            _checked(self._set(*self._arguments))
            self._held = list(values)

    def get(self) -> list[float]:
        """Their values."""
        if not len(self.values):
            return []
        _checked(self._get(*self._arguments))
        return list(self.values)


def _checked(status: int) -> None:
    """Raise RuntimeError where a call did not succeed; a warning is a success."""
    if status > 1:
        raise RuntimeError(f"the unit answers with status {status}")


class UnitMotion:
    """A unit from its start with these parameters, step by step, with the forces of `laws` at its doors."""

    def __init__(
        self,
        unit: Unit,
        values: dict[str, float],
        inputs: list[str],
        outputs: list[str],
        step_s: float,
        doors: list[tuple[str, str, str]],
        laws: Any = None,
    ) -> None:
        self.unit, self.step_s, self.time = unit, step_s, 0.0
        self.laws = np.zeros((0, 1)) if laws is None else np.ascontiguousarray(laws, np.float64)
        self.bristles, self.before = np.zeros(len(self.laws)), np.zeros(len(self.laws))
        self.forces, self.known = np.zeros(len(doors)), np.zeros(len(doors))
        self.own: list[int] = [i for i, door in enumerate(doors) if door[0] not in inputs]
        unit.begin(values)
        self._entering = Ports(unit, [*inputs, *(doors[i][0] for i in self.own)])
        self._shown = Ports(unit, outputs)
        self._moving = Ports(unit, [name for door in doors for name in door[1:]])
        self._motion: Any = np.ctypeslib.as_array(self._moving.values).reshape(-1, 2)
        self._moving.get()
        self.start, self.last = self._motion.copy(), self._motion.copy()

    def outputs(self) -> list[float]:
        """Those of now."""
        return self._shown.get()

    def step(self, inputs: list[float]) -> None:
        """One step with these inputs."""
        if len(self.laws):
            self._moving.get()
            forces_of(
                self.laws,
                self._motion,
                self.last,
                self.start,
                self.before,
                self.bristles,
                self.step_s,
                self.forces,
            )
        if len(self.own):
            inputs = [*inputs, *(self.forces + self.known)[self.own].tolist()]
        self._entering.put(inputs)
        self.unit.step(self.time, self.step_s)
        self.time += self.step_s
