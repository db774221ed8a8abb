"""One effect's form in the joint search: where it acts in the kernel, its parameters, its starts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayes_hw.gap.joint.forms import effect_codes as K  # noqa: N812

Place = Literal["input", "output", "law", "reading"]

INNOVATION_COLUMN = "(output)"
"""What stands for the readings themselves among the columns that an effect acts by."""


@dataclass(frozen=True)
class JointScale:
    """Sizes natural to the records: `speed` of the limited command (input units), `gain` output units per
    sample and unit of command, `travel` (of all records together) and `sigma` in output units, `samples` of
    the longest record; `periods` and `motor_periods` (output units) are those that a scan found promising in
    the positions of the load and of the motor, `shortest` the shortest that may be looked for: what rounding
    does repeats with its step."""

    speed: float
    gain: float
    travel: float
    sigma: float
    samples: int
    rate_hz: float
    periods: tuple[float, ...] = ()
    motor_periods: tuple[float, ...] = ()
    shortest: float = 0.0

    @property
    def twist(self) -> float:
        """Second difference of w when the speed changes by its limit over ten samples."""
        return 0.1 * self.speed * self.gain


@dataclass(frozen=True)
class Slot:
    """One parameter: its row in the kernel's array, name, bounds; `logarithmic` ones are positive."""

    row: int
    name: str
    logarithmic: bool = False
    lower: float = -np.inf
    upper: float = np.inf


@dataclass(frozen=True)
class Form:
    """One form of a label.

    `slots` gives its parameters for a scale, `starts` the values (parameters,) to begin from, at which the
    form changes nothing. A form with a `column` acts by that known input of the records: through the load as
    a "law", at the encoder as a "reading". A form that is `further` extends another of its label by
    parameters, and is tried where that one is present: begun at its values, and at those `otherwise` gives.
    One that `remembers` where the axis turned acts within a sample though it is no torque. The port of one
    that is `misread` is held to the way of what the loop reads (see `fit.held_port`).
    """

    label: str
    name: str
    place: Place
    slots: Callable[[JointScale], tuple[Slot, ...]]
    starts: Callable[[JointScale], Sequence[tuple[float, ...]]]
    law: int = -1
    base: int = 0
    column: str = ""
    further: bool = False
    remembers: bool = False
    misread: bool = False
    otherwise: Callable[[Mapping[str, float]], dict[str, float]] | None = None

    @property
    def is_law(self) -> bool:
        return self.place == "law"

    @property
    def is_known_input(self) -> bool:
        return bool(self.column) and self.column != INNOVATION_COLUMN

    @property
    def full_name(self) -> str:
        return f"{self.label} ({self.name})" if self.name else self.label

    @property
    def kind(self) -> str:
        """The label; of what has no name every form is a kind of its own."""
        return self.full_name if self.label == "other" else self.label

    def unit_of_signal(self, scale: JointScale) -> float:
        """What the law divides its signal by where no slot does: its size lies in the port alone."""
        return {K.CUBIC: scale.twist, K.DRAG: scale.speed * scale.gain}.get(self.law, 1.0)
