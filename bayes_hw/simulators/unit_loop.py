"""A functional mock-up unit in motion, with the forces of laws at its inputs.

Like `laws`, this module imports nothing else of bayes_hw: a corrected simulator carries its text.
"""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

from bayes_hw.simulators.laws import law_force


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
        references = [self.references[name] for name in names]
        if references:
            (self.slave.setReal if self.second else self.slave.setFloat64)(references, values)

    def get(self, names: list[str]) -> list[float]:
        """Values of variables."""
        references = [self.references[name] for name in names]
        return list((self.slave.getReal if self.second else self.slave.getFloat64)(references))

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
    ) -> Any:
        """Outputs (samples, outputs) for inputs (samples,) by name, each held for `substeps` of `step_s`.

        `doors` are names of force input, position and speed; `laws` (laws, LAW_NUMBERS) and forces that are
        `known` (samples, doors) act there.
        """
        motion = UnitMotion(self, values, list(inputs), outputs, step_s, doors or [], laws)
        signals = np.column_stack(list(inputs.values())).tolist()
        found = []
        for k, row in enumerate(signals):
            found.append(motion.outputs())
            if known is not None:
                motion.known[:] = known[k]
            for _ in range(substeps):
                motion.step(row)
        return np.array(found, np.float64).reshape(-1, len(outputs))


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
        self.laws = np.zeros((0, 1)) if laws is None else np.asarray(laws, np.float64)
        self.bristles, self.before = np.zeros(len(self.laws)), np.zeros(len(self.laws))
        self.forces, self.known = np.zeros(len(doors)), np.zeros(len(doors))
        self.own = [i for i, door in enumerate(doors) if door[0] not in inputs]
        self.entering = [*inputs, *(doors[i][0] for i in self.own)]
        self.shown, self.moving = outputs, [name for door in doors for name in door[1:]]
        unit.begin(values)
        self.start = self.last = self._motion()

    def outputs(self) -> list[float]:
        """Those of now."""
        return self.unit.get(self.shown)

    def _motion(self) -> Any:
        """Position and speed (doors, 2) of every door."""
        return np.array(self.unit.get(self.moving)).reshape(-1, 2) if len(self.laws) else np.zeros((0, 2))

    def step(self, inputs: list[float]) -> None:
        """One step with these inputs."""
        if len(self.laws):
            now, h = self._motion(), self.step_s
            self.forces[:] = 0.0
            for i, law in enumerate(self.laws):
                door = int(law[1])
                at = int(law[10]) - 1 if law[10] > 0 else door
                free = 2 * now[door, 1] - self.last[door, 1] - h * law[9] * self.before[i]
                x = now[at, 0] - self.start[at, 0]
                self.before[i], self.bristles[i] = law_force(law, x, free, self.bristles[i], h)
                self.forces[door] += self.before[i]
            self.last = now
        self.unit.put(self.entering, [*inputs, *(float(self.forces[i] + self.known[i]) for i in self.own)])
        self.unit.slave.doStep(self.time, self.step_s)
        self.time += self.step_s
