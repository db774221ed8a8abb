"""What a diagnosis needs of the simulator whose gap is asked for, and simulators that are functions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.model.parameters import Parameter
from bayes_hw.record import Units


class Force(Protocol):
    """An acceleration that depends on the motion: a force over the inertia that it acts on.

    A compiled simulator may take the law by its numbers, `settings` (batch, COUNT) as
    `bayes_hw.gap.simulate.settings` numbers them, and the known `signal` (samples,) where there is one.
    """

    @property
    def settings(self) -> FloatArray: ...

    @property
    def signal(self) -> FloatArray | None: ...

    def __call__(self, k: int, position: FloatArray, velocity: FloatArray) -> FloatArray:
        """Acceleration (batch,), output units per s^2, at sample k for positions and velocities (batch,)."""
        ...


class Simulator(Protocol):
    """A simulator of one axis, of any kind.

    `parameters` are re-estimated in every diagnosis, each with a normal prior as it is or a log-normal prior
    and a logarithm; `noise_sigma` is the noise of the measured output in output units, NaN where unknown.
    With `force_door` the simulator adds a force that depends on its own motion, so that friction and ripple
    can be tried as its missing effects. One that has `known_inputs`, names of further measured columns of the
    records (a wind, a motor's torque), is given the command and these beside it.
    """

    @property
    def name(self) -> str: ...

    @property
    def parameters(self) -> tuple[Parameter, ...]: ...

    @property
    def sample_rate_hz(self) -> float: ...

    @property
    def units(self) -> Units: ...

    @property
    def noise_sigma(self) -> float: ...

    @property
    def force_door(self) -> bool: ...

    def simulate(self, values: FloatArray, inputs: FloatArray, force: Force | None = None) -> FloatArray:
        """Outputs (batch, samples) for parameter values (batch, parameters) and commands (samples,), or with
        known inputs (samples, 1 + columns).

        `force` is None unless `force_door`; its accelerations are to be added to those of the simulator.
        """
        ...


def known_inputs(simulator: object) -> tuple[str, ...]:
    """Further measured columns that it is given beside the command."""
    return tuple(getattr(simulator, "known_inputs", ()))


def command_of(inputs: FloatArray) -> FloatArray:
    """The command (samples,) of inputs (samples,) or (samples, columns)."""
    return np.ascontiguousarray(inputs if inputs.ndim == 1 else inputs[:, 0], np.float64)


def with_command(command: FloatArray, inputs: FloatArray) -> FloatArray:
    """The inputs with another command (samples,)."""
    return command if inputs.ndim == 1 else np.column_stack([command, inputs[:, 1:]])


@runtime_checkable
class SimulatorWithDoors(Simulator, Protocol):
    """A simulator with a drive train: it takes the settings `obeyed` (numbers of
    `bayes_hw.gap.simulate.settings`) of the force that it is given, at motor, load and compliance.

    `stiffness` holds the accelerations at the motor, a quarter of it, and at the load that move the output by
    one unit at most.
    """

    @property
    def obeyed(self) -> frozenset[int]: ...

    @property
    def stiffness(self) -> tuple[float, float]: ...


def with_doors(simulator: Simulator) -> SimulatorWithDoors | None:
    """Itself, if it has a drive train."""
    return simulator if isinstance(simulator, SimulatorWithDoors) else None


Respond = Callable[..., FloatArray]
"""function(values, inputs), or function(values, inputs, force) of a simulator with a force door."""


@dataclass(frozen=True)
class FunctionSimulator:
    """A user's Python function as a simulator; see `Simulator` for what each field means.

    `function(values, inputs)` takes values (batch, parameters) in the order of `parameters` and inputs
    (samples,), with `known_inputs` (samples, 1 + columns), and returns outputs (batch, samples). With
    `force_door` it is called as
    `function(values, inputs, force)`: where `force` is not None, `force(k, position, velocity)` gives the
    acceleration (batch,) to add at sample k, in output units per s^2, for positions and velocities (batch,).
    """

    name: str
    function: Respond
    parameters: tuple[Parameter, ...]
    sample_rate_hz: float
    units: Units = field(default_factory=Units)
    noise_sigma: float = float("nan")
    force_door: bool = False
    known_inputs: tuple[str, ...] = ()

    def simulate(self, values: FloatArray, inputs: FloatArray, force: Force | None = None) -> FloatArray:
        """Outputs (batch, samples); raises InputError where the function returns another shape."""
        given = (values, inputs, force) if self.force_door else (values, inputs)
        found = np.asarray(self.function(*given), dtype=np.float64)
        if found.shape != (len(values), len(inputs)):
            raise InputError(
                f"simulator {self.name}: returned shape {found.shape}; return (batch, samples) = "
                f"{(len(values), len(inputs))}"
            )
        return found
