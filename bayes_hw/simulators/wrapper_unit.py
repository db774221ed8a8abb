"""The corrected axis as an FMU around the one that was given: its command in, its output out, and `draw`.

Needs fmpy beside the Python that the FMU runs in. It stands alone: nothing of bayes_hw is imported.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

from bayes_hw.gap.simulate.signal_kernel import command_side, output_side
from bayes_hw.simulators.corrected_run import numbers_of
from bayes_hw.simulators.unit_loop import Unit, UnitMotion


class CorrectedAxis(Fmi2Slave):  # type: ignore[misc]
    """Inputs and outputs in the units of the records; one step of it is one sample of theirs."""

    author = "bayes-hw"
    description = "an FMU with the effect that a diagnosis found"

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.command, self.angle, self.draw, self.ready = 0.0, 0.0, 0, False
        fixed = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.fixed}
        self.register_variable(Integer("draw", **fixed))
        self.register_variable(Real("command", causality=Fmi2Causality.input))
        self.register_variable(Real("angle", causality=Fmi2Causality.output))

    def exit_initialization_mode(self) -> None:
        """Begin with the chosen draw."""
        place = Path(self.resources or ".")
        self.numbers, one, self.settings = numbers_of(place, self.draw)
        loop = self.numbers["loop"]
        self.commands: list[float] = []
        self.seen: list[float] = []
        doors = [tuple(door) for door in loop["doors"]]
        unit = Unit(place / loop["unit"])
        laws = np.array(one["laws"], np.float64)
        self.motion = UnitMotion(
            unit, one["base"], loop["commands"], [loop["output"]], loop["step_s"], doors, laws
        )
        self.begin = self.motion.outputs()[0]
        self.ready = True

    def do_step(self, current_time: float, step_size: float) -> bool:  # noqa: ARG002
        """One sample of the records."""
        loop, rate = self.numbers["loop"], self.numbers["sample_rate_hz"]
        self.commands.append(self.command)
        count = len(self.commands)
        ahead, w, y = np.empty(count), np.empty(count + 1), np.empty(count + 1)
        command_side(np.array(self.commands), rate, self.settings, ahead)
        self.seen.append(self.motion.outputs()[0])
        value = float(ahead[-1]) * loop["input_factor"]
        for _ in range(loop["substeps"]):
            self.motion.step([value] * len(loop["commands"]))
        found = (np.array([*self.seen, self.motion.outputs()[0]]) - self.begin) * loop["output_factor"]
        output_side(found, rate, self.settings, w, y)
        self.angle = float(y[-1])
        return True

    def terminate(self) -> None:
        """Let go of the FMU inside."""
        if self.ready:
            self.motion.unit.close()
            self.ready = False
