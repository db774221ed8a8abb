"""All that is measured on records before any model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.delay import Delay
from bayes_hw.first_look.distortion import Distortion
from bayes_hw.first_look.feedback import Feedback
from bayes_hw.first_look.known_columns import KnownColumn
from bayes_hw.first_look.motion import PositionError, Regime, SpeedMap
from bayes_hw.first_look.noise import NoiseSpectrum
from bayes_hw.first_look.repeated import RepeatedError
from bayes_hw.first_look.response import MeasuredResponse
from bayes_hw.first_look.statics import Statics
from bayes_hw.record import Record

TURNS = {
    "deg": 360.0,
    "rad": 2 * np.pi,
    "arcmin": 21600.0,
    "arcsec": 1296000.0,
    "rev": 1.0,
    "mrad": 2000 * np.pi,
}


@dataclass(frozen=True, eq=False)
class Measures:
    """What `records` show; arrays per record have the record's length.

    `origins` are the angles that count as zero. `errors` are outputs less what the linear response to the
    command within its limits explains, up to a constant, a slope and a factor. `response`, `noise`, `delay`
    are None where the records are too short or the command never moves. `repeated` is the part of the errors
    that goes with the direction of motion and with the angle; `noise_sigma` is the noise beside it.
    """

    records: tuple[Record, ...]
    origins: tuple[float, ...]
    errors: tuple[FloatArray, ...]
    repeated: RepeatedError
    statics: Statics
    response: MeasuredResponse | None
    noise: NoiseSpectrum | None
    noise_sigma: float
    white_sigma: float
    resolution: float | None
    delay: Delay | None
    drift_per_hour: tuple[float, float]
    distortion: Distortion | None
    feedback: Feedback | None
    speed: SpeedMap
    position: PositionError
    regimes: dict[str, Regime]
    reversals: int
    at_limits: tuple[float, float]
    known: tuple[KnownColumn, ...] = ()

    @property
    def duration_s(self) -> float:
        return sum(record.duration_s for record in self.records)

    @property
    def turn(self) -> float | None:
        """A whole turn in the output's unit, where it has one."""
        return TURNS.get(self.records[0].units.output)

    @property
    def apart(self) -> Statics:
        """Limits and dead zone apart from what repeats with direction and angle, where that is seen."""
        return self.repeated.statics if self.repeated.is_seen else self.statics
