"""What axes that a program of their own steps have in common: their declaration, and the axis linearised."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.model.parameters import Parameter
from bayes_hw.simulators.declaration import Declaration
from bayes_hw.simulators.linear_axis import LinearAxis, LinearSystem
from bayes_hw.simulators.linear_kernel import MOTOR


class SteppedAxis(ABC):
    """Commands, outputs and forces in the record's units; `substeps` steps of the program make a sample."""

    force_door = True
    substeps: int
    parameters: tuple[Parameter, ...]

    def __init__(self, path: Path, declaration: Declaration) -> None:
        self.path, self.declaration = path, declaration
        self.name, self.units = declaration.name, declaration.units
        self.sample_rate_hz, self.noise_sigma = declaration.sample_rate_hz, declaration.noise_sigma
        self.known_inputs = tuple(force.column for force in declaration.known)

    @property
    @abstractmethod
    def doors(self) -> frozenset[str]:
        """Those that it has."""

    @abstractmethod
    def linearised(self, values: FloatArray) -> LinearSystem:
        """The linear system at parameter values (parameters,)."""

    @cached_property
    def limits(self) -> tuple[float, float]:
        """Commands that it takes."""
        return -np.inf, np.inf

    @property
    def obeyed(self) -> frozenset[int]:
        """Settings of forces within the axis that it takes."""
        return self.linear.obeyed

    @property
    def stiffness(self) -> tuple[float, float]:
        """As that of the linear axis."""
        return self.linear.stiffness

    @cached_property
    def linear(self) -> LinearAxis:
        """The axis linearised about its rest."""
        return LinearAxis(
            self.name,
            self.parameters,
            self.sample_rate_hz,
            self.units,
            self.noise_sigma,
            self.substeps,
            self.doors,
            self.limits,
            self.linearised,
            self.declaration.known,
        )

    def entering(self, places: Sequence[str]) -> list[tuple[str, int, float]]:
        """Of every known force its column, the number of its door among `places`, and its factor."""
        return [(force.column, places.index(force.door), force.factor) for force in self.declaration.known]

    def forces_at(
        self, places: Sequence[str], values: FloatArray, inputs: FloatArray, signal: FloatArray | None
    ) -> FloatArray | None:
        """Known forces (samples, places) at the doors named, in the program's units: those of the inputs
        (samples, columns), and a known acceleration `signal` (samples,) at the motor; None without any."""
        if signal is None and not self.declaration.known:
            return None
        found = np.zeros((len(inputs), len(places)))
        for column, (_, door, factor) in enumerate(self.entering(places), start=1):
            found[:, door] += factor * inputs[:, column]
        if signal is not None:
            found[:, places.index("motor")] += float(self.linear.system(values).inertia[MOTOR]) * signal
        return found
