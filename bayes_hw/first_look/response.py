"""The response of an axis with limits and dead zone taken out, and what it is with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.frequency_response import PROBABILITY, FrequencyResponse, frequency_response
from bayes_hw.first_look.statics import Statics

COARSE = 30
"""Frequencies at which the response is repeated with limits and half width moved."""

SIGMAS = float(special.ndtri(0.5 + PROBABILITY / 2))


@dataclass(frozen=True, eq=False)
class MeasuredResponse:
    """`linear` is the response between the limits and outside the dead zone; `best_linear` that of the raw
    record.

    Both have the same frequencies. The second is the best linear approximation under this very command:
    smaller wherever limits or dead zone are met, by as much as this command meets them.
    """

    linear: FrequencyResponse
    best_linear: FrequencyResponse


def measured_response(
    outputs: Sequence[FloatArray], commands: Sequence[FloatArray], sample_rate_hz: float, statics: Statics
) -> MeasuredResponse | None:
    """None where records are too short. The band of `linear` holds that of limits and dead zone."""

    def response(shift: FloatArray | None, most: int | None = None) -> FrequencyResponse | None:
        opened = [statics.opened(k, y, shift) for k, y in enumerate(outputs)]
        limited = [statics.limited(u, shift) for u in commands]
        if most is None:
            return frequency_response(opened, limited, sample_rate_hz)
        return frequency_response(opened, limited, sample_rate_hz, most)

    raw, linear = frequency_response(outputs, commands, sample_rate_hz), response(None)
    if raw is None or linear is None:
        return None
    if statics.spread.shape[1] == 0:
        return MeasuredResponse(linear, raw)
    middle = response(None, COARSE)
    relative = np.zeros(len(linear.frequency_hz))
    for column in statics.spread.T:
        moved = response(column, COARSE)
        if middle is None or moved is None or len(moved.frequency_hz) != len(middle.frequency_hz):
            continue
        change = np.abs(moved.magnitude - middle.magnitude) / middle.magnitude
        relative += np.interp(linear.frequency_hz, middle.frequency_hz, change) ** 2
    centre, half = (linear.upper + linear.lower) / 2, (linear.upper - linear.lower) / 2
    half = np.sqrt(half**2 / statics.seen + (SIGMAS * linear.magnitude) ** 2 * relative)
    widened = replace(linear, lower=np.maximum(centre - half, 0.0), upper=centre + half)
    return MeasuredResponse(widened, raw)
