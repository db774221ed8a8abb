"""The sizes of an axis and its records, by which effects choose their priors and starting values."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.case.lattice import shortest_period
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record, Units


@dataclass(frozen=True)
class AxisScale:
    """`rate` in Hz, `duration` of the longest record in s, `travel` and `sigma` in output units, `speed` in
    input units (the larger limit, or the largest command where no limit is reached), `stiffness` (km, kl) of
    the drive train, `first_mode_hz`, `shortest` the shortest period of an error over position that is not of
    the rounding itself, output units.
    """

    rate: float
    duration: float
    travel: float
    speed: float
    sigma: float
    first_mode_hz: float
    stiffness: tuple[float, float]
    velocity_gain: float
    units: Units
    shortest: float = 0.0

    @property
    def output_speed(self) -> float:
        """Speed of the axis in output units per second."""
        return self.speed * self.velocity_gain


def axis_scale(
    model: HammersteinWiener,
    records: Sequence[Record],
    sigma: float,
    stiffness: tuple[float, float],
) -> AxisScale:
    """The scale of `model` on `records`, with noise `sigma` in output units."""
    rate = model.sample_rate_hz
    commanded = max(float(np.abs(record.u).max()) for record in records)
    limit = max(abs(model.saturation.lower), abs(model.saturation.upper))
    gain = model.linear.velocity_gain(rate)
    modes = [mode.frequency_hz for mode in model.dominant_modes] or [rate / 10]
    return AxisScale(
        rate=rate,
        duration=max(len(record.u) for record in records) / rate,
        travel=max(float(np.ptp(record.y)) for record in records),
        speed=min(limit, commanded) if np.isfinite(limit) else commanded,
        sigma=sigma,
        first_mode_hz=modes[0],
        stiffness=stiffness,
        velocity_gain=abs(gain) if np.isfinite(gain) else 1.0,
        units=model.units,
        shortest=shortest_period([record.y for record in records]),
    )
