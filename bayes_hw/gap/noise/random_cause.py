"""The random causes that can be named, each with what it answers of itself.

No simulator can follow a random cause: what is said of one is what becomes of the records beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from types import MappingProxyType

ROUNDING = "encoder_quantization"
"""The label of a fact rather than a hypothesis: a lattice of the measured values is seen."""


class Tracking(IntEnum):
    """How much of the axis's motion a record tells beside a cause."""

    EVERY_SAMPLE = 0
    """Motion follows from command and parameters, and each reading shows it but for the encoder's noise."""

    HIDDEN = 1
    """Readings are off by more than the motion that an explanation may have left."""

    MEAN_SQUARES = 2
    """Motion, or the instants at which it is read, are random or chaotic: only sizes of errors tell."""


@dataclass(frozen=True)
class RandomCause:
    """A random cause: its label, and its answers.

    `alone` is how the records track the axis where it is the only cause, `beside` where a response is fitted
    too; `slow`, that a simulation may lose motion that it then holds in the place of a chaotic effect;
    `through_axis`, that it acts as a torque, so that an effect that bends the path of torques bends it;
    `isolated`, that it spoils some samples and leaves those beside them; `untimely`, that it moves the
    instants at which the axis is read.
    """

    label: str
    alone: Tracking = Tracking.EVERY_SAMPLE
    beside: Tracking = Tracking.EVERY_SAMPLE
    slow: bool = False
    through_axis: bool = False
    isolated: bool = False
    untimely: bool = False


WIND = RandomCause("wind", Tracking.MEAN_SQUARES, Tracking.MEAN_SQUARES, slow=True, through_axis=True)
WALK = RandomCause("sensor_drift", Tracking.HIDDEN, Tracking.HIDDEN, slow=True)
JITTER = RandomCause("timing_jitter", Tracking.MEAN_SQUARES, Tracking.MEAN_SQUARES, untimely=True)
GLITCHES = RandomCause("outliers", Tracking.HIDDEN, Tracking.EVERY_SAMPLE, isolated=True)
ROUNDED = RandomCause(ROUNDING, Tracking.HIDDEN, Tracking.HIDDEN)

RANDOM_CAUSES: Mapping[str, RandomCause] = MappingProxyType(
    {cause.label: cause for cause in (WIND, WALK, JITTER, GLITCHES, ROUNDED)}
)
