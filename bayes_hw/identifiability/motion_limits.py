"""What an axis may be asked to do, and commands that keep to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.record import Record


@dataclass(frozen=True)
class MotionLimits:
    """Largest velocity command and its largest rate of change (input units, and those per s), and the stroke:
    the outputs between which the axis must stay (output units)."""

    velocity: float
    acceleration: float
    lowest: float
    highest: float

    def __post_init__(self) -> None:
        for name in ("velocity", "acceleration"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name} limit: must be finite and positive, got {value:g}")
        if not self.lowest < self.highest:
            raise InputError(
                f"stroke: needs lowest < highest, got {self.lowest:g} and {self.highest:g}; give both ends"
            )

    def hold(self, outputs: FloatArray) -> bool:
        """Whether all outputs stay within the stroke."""
        return bool(np.all(outputs >= self.lowest) and np.all(outputs <= self.highest))


def limits_for(
    records: Sequence[Record],
    velocity: float | None = None,
    acceleration: float | None = None,
    stroke: Sequence[float] | None = None,
) -> MotionLimits:
    """The limits as given, and what is not given as large as the records show that the axis has done before.

    Raises InputError when one is neither given nor can be read off records.
    """
    if not records and (velocity is None or acceleration is None or stroke is None):
        raise InputError(
            "--velocity, --acceleration and --stroke: give all three; the posterior holds no records to take"
            " them from"
        )
    if velocity is None:
        velocity = max(float(np.max(np.abs(record.u))) for record in records)
    if acceleration is None:
        acceleration = max(float(np.max(np.abs(np.diff(r.u)))) * r.sample_rate_hz for r in records)
    if stroke is None:
        stroke = min(float(r.y.min()) for r in records), max(float(r.y.max()) for r in records)
    return MotionLimits(velocity, acceleration, stroke[0], stroke[1])


def kept_within(u: FloatArray, limits: MotionLimits, sample_rate_hz: float) -> FloatArray:
    """The command (samples,) followed as closely as velocity and acceleration allow, from rest to rest.

    It is clipped, then followed at no more than the largest step a sample, and brought back to zero at the
    end.
    """
    step = limits.acceleration / sample_rate_hz
    wanted = np.clip(u, -limits.velocity, limits.velocity).tolist()
    followed = np.empty(len(wanted))
    current = 0.0
    for k, value in enumerate(wanted):
        current += min(max(value - current, -step), step)
        followed[k] = current
    to_rest = step * np.arange(len(wanted), 0, -1)
    return np.clip(followed, -to_rest, to_rest)
