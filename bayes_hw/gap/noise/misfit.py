"""What a simulated response leaves of the records: all that a noise model sees of a fit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.simulate.builder import SignalChain


class Misfit(Protocol):
    """Records beside their simulation; all arrays (samples,), one a record, in output units."""

    @property
    def residuals(self) -> list[FloatArray]:
        """Measured less simulated outputs."""
        ...

    @property
    def unread(self) -> Sequence[BoolArray] | None:
        """Which samples were not measured; None where all were."""
        ...

    @property
    def readings(self) -> int:
        """Samples of all records that were measured."""
        ...

    @property
    def simulated(self) -> list[FloatArray]: ...

    @property
    def measured(self) -> list[FloatArray]: ...

    @property
    def rmse(self) -> float:
        """Root mean square of the residuals."""
        ...

    @property
    def scale(self) -> AxisScale: ...

    def chain(self) -> SignalChain:
        """The linear block that simulated the outputs."""
        ...

    def motion(self) -> tuple[list[FloatArray], float]:
        """w of every record, and the half width of the dead zone that hides it where it is small."""
        ...

    def with_residuals(self, residuals: list[FloatArray]) -> Misfit:
        """The same simulation with other residuals."""
        ...
