"""What every effect of the catalogue is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.scale import AxisScale
from bayes_hw.gap.effects.descriptions import Description
from bayes_hw.gap.effects.labels import Block
from bayes_hw.gap.simulate.injection_point import InjectionPoint
from bayes_hw.gap.simulate.resonator import Resonator
from bayes_hw.model.parameters import Parameter


class Effect(ABC):
    """One effect that changes the response: parameters in, settings of the chain simulator out.

    A subclass says in its docstring the equation, the source and when not to believe it. `label` is that of
    the catalogue, `form` tells forms of one label apart, `test_values` are parameters that a test can use,
    `needs_drive_train` says that the torque paths behind G matter, `starts_tried` how many of the
    screened starts a fit begins from, `derivative_step` the finite difference in prior standard deviations,
    `chaotic` that its motion cannot be predicted for long, so that what it leaves looks stochastic,
    `rugged` that its motion is chaotic or jumps, so that it is fitted while it is followed too,
    `bends_path` that the resonances by which a load torque reaches the encoder change with the motion,
    `ripples` that a torque depends on the position, `description` what the documentation says of a label that
    is not built in.
    """

    label: ClassVar[str]
    block: ClassVar[Block]
    form: ClassVar[str] = ""
    test_values: ClassVar[tuple[float, ...]]
    needs_drive_train: ClassVar[bool] = False
    starts_tried: ClassVar[int] = 1
    derivative_step: ClassVar[float] = 3e-4
    chaotic: ClassVar[bool] = False
    rugged: ClassVar[bool] = False
    bends_path: ClassVar[bool] = False
    ripples: ClassVar[bool] = False
    description: ClassVar[Description | None] = None

    @property
    def name(self) -> str:
        """Label and form."""
        return f"{self.label} ({self.form})" if self.form else self.label

    @abstractmethod
    def parameters(self, scale: AxisScale) -> tuple[Parameter, ...]:
        """The effect's parameters, named LABEL.NAME, with priors for an axis of this scale."""

    @abstractmethod
    def apply(self, values: FloatArray, settings: FloatArray, scale: AxisScale) -> None:
        """Write parameter values (parameters,) into `settings` (see `bayes_hw.gap.simulate.settings`)."""

    @property
    def vanishing_values(self) -> tuple[float, ...]:
        """Parameters at which the effect is next to nothing: `test_values` with the first, its size, tiny."""
        return (1e-9, *self.test_values[1:])

    @property
    def periodic(self) -> PeriodicEffect | None:
        """Itself, if it is a sine of the axis position."""
        return None

    def resonator(self, values: FloatArray) -> Resonator | None:
        """The resonator that the effect hangs on the load, if it does."""
        return None

    def starts_at(self, frequencies_hz: FloatArray) -> Sequence[tuple[float, ...]]:
        """Further values to screen where the residual has lines at `frequencies_hz` (lines,)."""
        return []

    def refined(self, values: FloatArray) -> Sequence[tuple[Effect, tuple[float, ...]]]:
        """Forms of more parameters or of another place, with their starts, to try where this one at `values`
        leaves structure."""
        return []

    def missed_torsion(self, values: FloatArray, scale: AxisScale) -> float:
        """Of a `rugged` effect: the torsion, output units, whose torque is missing where motion is lost."""
        return scale.sigma

    @abstractmethod
    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        """Parameter values to screen, a small grid of sizes and shapes."""


SECOND_HARMONIC = 3
"""Where its sine and cosine stand among the parameters of a periodic effect."""


class PeriodicEffect(Effect):
    """An effect that is a sine of the axis position: amplitude and phase are linear, the period is scanned.

    Its parameters are the amplitudes of sine and cosine and the period, in this order.
    """

    door: ClassVar[InjectionPoint]
    only_saturated: ClassVar[bool] = False

    @property
    def periodic(self) -> PeriodicEffect:
        return self

    def write_wave(self, first: int, values: FloatArray, settings: FloatArray) -> None:
        """Write the wave of `values` into `settings` from row `first` on (`bayes_hw.gap.simulate.settings`).

        Behind the parameters above stand sine and cosine of the second harmonic, if any.
        """
        settings[first], settings[first + 1] = np.hypot(values[0], values[1]), values[2]
        settings[first + 2] = np.arctan2(values[1], values[0])
        if len(values) > SECOND_HARMONIC:
            sine, cosine = values[SECOND_HARMONIC : SECOND_HARMONIC + 2]
            settings[first + 3], settings[first + 4] = np.hypot(sine, cosine), np.arctan2(cosine, sine)

    @property
    def vanishing_values(self) -> tuple[float, ...]:
        period, *rest = self.test_values[2:]
        return (1e-9, 1e-9, period, *(0.0 for _ in rest))

    def starts(self, scale: AxisScale) -> Sequence[tuple[float, ...]]:
        return []


def everywhere_periodic(effects: Iterable[Effect]) -> list[Effect]:
    """Those periodic in the position, whatever the command does."""
    return [e for e in (effect.periodic for effect in effects) if e is not None and not e.only_saturated]
