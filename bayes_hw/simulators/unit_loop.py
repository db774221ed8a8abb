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
        self._set(list(values), list(values.values()))
        self.slave.enterInitializationMode()
        self._set(list(values), list(values.values()))
        self.slave.exitInitializationMode()

    def _set(self, names: list[str], values: list[float]) -> None:
        references = [self.references[name] for name in names]
        if references:
            (self.slave.setReal if self.second else self.slave.setFloat64)(references, values)

    def run(
        self,
        values: dict[str, float],
        inputs: dict[str, Any],
        outputs: list[str],
        substeps: int,
        step_s: float,
        doors: list[tuple[str, str, str]] | None = None,
        laws: Any = None,
        every_step: bool = False,
    ) -> Any:
        """Outputs (samples, outputs) for inputs (samples,) by name, each held for `substeps` of `step_s`.

        `doors` are names of force input, position and speed; `laws` (laws, LAW_NUMBERS) act there, positions
        counted from the start. With `every_step` the outputs are those of every step.
        """
        self.begin(values)
        names, doors = list(inputs), doors or []
        rows = np.zeros((0, 1)) if laws is None else np.asarray(laws, np.float64)
        given = [self.references[name] for name in (*names, *(door[0] for door in doors))]
        count, watched = len(outputs), list(outputs)
        if len(rows):
            watched += [name for door in doors for name in door[1:]]
        asked = [self.references[name] for name in watched]
        get = self.slave.getReal if self.second else self.slave.getFloat64
        put = self.slave.setReal if self.second else self.slave.setFloat64
        signals = np.column_stack([inputs[name] for name in names]) if names else np.zeros((0, 0))
        found, forces = [], np.zeros(len(doors))
        bristles, before = np.zeros(len(rows)), np.zeros(len(rows))
        start, last = None, None
        own = [i for i, door in enumerate(doors) if door[0] not in names]
        references = given[: len(names)] + [given[len(names) + i] for i in own]
        for k in range(len(signals)):
            for j in range(substeps):
                seen = get(asked)
                if j == 0 or every_step:
                    found.append(seen[:count])
                if len(rows):
                    moved = np.array(seen[count:]).reshape(len(doors), 2)
                    start = moved[:, 0].copy() if start is None else start
                    last = moved[:, 1] if last is None else last
                    forces[:] = 0.0
                    for i, law in enumerate(rows):
                        door = int(law[1])
                        at = int(law[10]) - 1 if law[10] > 0 else door
                        free = 2 * moved[door, 1] - last[door] - step_s * law[9] * before[i]
                        x = moved[at, 0] - start[at]
                        before[i], bristles[i] = law_force(law, x, free, bristles[i], step_s)
                        forces[door] += before[i]
                    last = moved[:, 1]
                put(references, [*signals[k].tolist(), *(float(forces[i]) for i in own)])
                self.slave.doStep((k * substeps + j) * step_s, step_s)
        return np.array(found, np.float64).reshape(-1, count)
