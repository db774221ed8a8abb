"""What a simulator in a file is to the diagnosis, whatever the file."""

from __future__ import annotations

from typing import Protocol

from bayes_hw.gap.case.simulator import SimulatorWithDoors
from bayes_hw.simulators.declaration import Declaration
from bayes_hw.simulators.linear_axis import LinearAxis


class SimulatorFile(SimulatorWithDoors, Protocol):
    """A simulator in a file, with what is declared of it and the axis linearised about its rest."""

    declaration: Declaration

    @property
    def linear(self) -> LinearAxis: ...
