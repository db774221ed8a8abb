"""The delay from command to output: the first lag at which the command moves the output.

Two estimates that lean on different things. One weighs autoregressions of the output by how well they predict
(`weighed_lags`): slow and resonant responses are in it, noise of the reading is not. The other refutes that
the first lags of the command do nothing (`refuted_lags`): any noise is in it, a response of seconds is not.
Where both are close and alike the delay is between the ends of both. Where they are not, the axis begins to
move so slowly that it is seen only later, or it does not move as either says, as behind a gap: then it is
known to be below the larger of both, and no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.refuted_lags import refuted_lags
from bayes_hw.first_look.weighed_lags import weighed_lags

RATE_HZ = 50.0
"""Faster records are averaged down to about this rate, below which the steps of a drive are slow."""

CLOSE = 2.0
"""Samples between the ends of an estimate that is close."""


@dataclass(frozen=True)
class Delay:
    """Mean, standard deviation and 94 % interval in s; `step_s` is the period that they are read at."""

    mean: float
    sd: float
    low: float
    high: float
    step_s: float

    @property
    def is_close(self) -> bool:
        """Whether it is known to about the samples that no record tells apart."""
        return self.high - self.low <= (CLOSE + 0.1) * self.step_s


def delay(
    outputs: Sequence[FloatArray],
    commands: Sequence[FloatArray],
    sample_rate_hz: float,
    seen: float = 1.0,
) -> Delay | None:
    """None where the records are too short, the command never moves, or is not seen to move the output.

    `seen` is the share of the samples that tell of the motion, `Statics.seen`.
    """
    factor = max(1, int(sample_rate_hz / RATE_HZ))
    step = factor / sample_rate_hz
    found = (
        weighed_lags(outputs, commands, factor, seen),
        refuted_lags(outputs, commands, factor),
    )
    ends = [one for one in found if one is not None]
    if found[0] is None:
        return None
    high = max(last for _, last in ends) * step
    are_close = len(ends) == len(found) and all(last - first <= CLOSE for first, last in ends)
    are_alike = max(first for first, _ in ends) < min(last for _, last in ends)
    low = min(first for first, _ in ends) * step if are_close and are_alike else 0.0
    return Delay((low + high) / 2, float((high - low) / np.sqrt(12)), low, high, step)
