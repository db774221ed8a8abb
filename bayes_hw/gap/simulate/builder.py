"""What a hypothesis builds on: from base parameter values to something that simulates commands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

from bayes_hw.arrays import FloatArray
from bayes_hw.model.parameters import Parameter

if TYPE_CHECKING:
    from bayes_hw.gap.simulate.resonator import Resonator


class SignalChain(Protocol):
    """A base model at fixed parameters; `bayes_hw.gap.simulate.signals` simulates it."""

    @property
    def delay_samples(self) -> int: ...

    @property
    def stiffness(self) -> tuple[float, float]: ...

    @property
    def contact_damping(self) -> float: ...


class Builder(Protocol):
    """Builds signal chains from base parameter vectors.

    `start_spreads` says how widely the first base parameters are spread, in coordinates, where a fit of the
    base model starts from several points; those after them start as given.
    """

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
