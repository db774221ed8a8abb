"""What a hypothesis builds on: from base parameter values to something that simulates commands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.simulate.injection_point import InjectionPoint, InjectionStates
from bayes_hw.gap.simulate.path import Path
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.model.parameters import Parameter

Signals: TypeAlias = tuple[FloatArray, FloatArray]
"""w and y of one record, both (samples, chains)."""


@dataclass(frozen=True)
class KnownPositions:
    """Positions of the axis (samples,), one array a record, at which its ripple is taken by `share`: it acts
    that share of the way from the simulated w to them."""

    positions: Sequence[FloatArray]
    share: float


@dataclass(frozen=True)
class Followed:
    """Measured outputs (samples,), one array a record, infinite where there is no reading, and what a unit of
    the difference from them adds to the states that torques drive (states,).

    `spread` is the standard deviation of that difference, in units of the encoder's noise.
    """

    measured: Sequence[FloatArray]
    gains: FloatArray
    spread: float


class SignalChain(Protocol):
    """A base model at fixed parameters."""

    @property
    def delay_samples(self) -> int: ...

    @property
    def stiffness(self) -> tuple[float, float]: ...

    @property
    def contact_damping(self) -> float: ...

    @property
    def torque_path(self) -> Path | None:
        """From torques on motor and load to the motion; None where the drive train is not known."""
        ...

    def can_inject(self, door: InjectionPoint) -> bool:
        """Whether signals can be added at `door`: a user's simulator may take no force."""
        ...

    def injection_states(self, door: InjectionPoint) -> InjectionStates | None:
        """What small signals at `door` drive; None where only a simulation tells."""
        ...

    def small_responses(self, door: InjectionPoint, signals: FloatArray) -> FloatArray:
        """Change of w (samples, n) for `signals` (samples, n) added at `door`, each held over its sample."""
        ...

    def torsions(self, commands: FloatArray) -> FloatArray:
        """Torsion (samples, n) of the gear, motor less load in output units, under limited `commands`
        (samples, n), each held over its sample; zero where the drive train is not known."""
        ...


class Builder(Protocol):
    """Builds signal chains from base parameter vectors.

    `start_spreads` says how widely the first base parameters are spread, in coordinates, where a fit of the
    base model starts from several points; those after them start as given. `has_drive_train` says whether
    effects may reach inside: ripple at another position, forms of effects that need motor and load.
    """

    @property
    def has_drive_train(self) -> bool: ...

    @property
    def said_of_torques(self) -> tuple[str, ...]:
        """In words how torques reach the axis, where that is the builder's choice."""
        ...

    @property
    def said_of_structure(self) -> str:
        """In words what of the base model was not questioned."""
        ...

    @property
    def base_parameters(self) -> tuple[Parameter, ...]: ...

    @property
    def start_spreads(self) -> FloatArray: ...

    @property
    def gain_row(self) -> int | None:
        """The base parameter that scales the steady speed, whose coordinate is that of the speed; or None."""
        ...

    def speed_per_gain(self, values: FloatArray) -> FloatArray:
        """Steady speed per unit of command and gain (points,) at base parameters (points, parameters),
        relative to that of the nominal model."""
        ...

    def write_base(self, values: FloatArray, settings: FloatArray) -> None:
        """Write what parameter values (parameters,) say of limits and dead zone into `settings`."""
        ...

    def chain(
        self, values: FloatArray, resonator: Resonator | None = None, needs_train: bool = True
    ) -> SignalChain:
        """The base model at base parameters `values` (base parameters,)."""
        ...

    def chains(
        self, values: FloatArray, resonators: Sequence[Resonator | None], needs_train: bool = True
    ) -> Sequence[SignalChain]:
        """The same at every row of `values` (points, base parameters)."""
        ...

    def simulate(
        self,
        chains: Sequence[Any],
        settings: FloatArray,
        inputs: Sequence[FloatArray],
        keep_w: bool = False,
        known: KnownPositions | None = None,
        followed: Followed | None = None,
    ) -> list[Signals]:
        """Signals of every record under every chain that this has built and its row of `settings` (chains,
        COUNT).

        `inputs` holds the commands (samples,), with known inputs (samples, columns), one a record. Without
        `keep_w` the w may have no samples. `known` says where ripple of a drive train acts if not at the
        simulated position; `followed` what the states are corrected by.
        """
        ...
