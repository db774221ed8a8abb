"""What a simulator in a file is to the diagnosis, whatever the file."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

import numpy as np

from bayes_hw.gap.case.simulator import SimulatorWithDoors
from bayes_hw.gap.diagnosis import Diagnosis
from bayes_hw.simulators.declaration import Declaration
from bayes_hw.simulators.linear_axis import LinearAxis


class SimulatorFile(SimulatorWithDoors, Protocol):
    """A simulator in a file, with what is declared of it and the axis linearised about its rest."""

    declaration: Declaration

    @property
    def linear(self) -> LinearAxis: ...

    def write_corrected(self, diagnosis: Diagnosis, folder: Path, rng: np.random.Generator) -> None:
        """The simulator with the answer's effects, to a folder of its own."""
        ...
