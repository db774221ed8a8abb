"""Axes of the torque-level plant of this package, their sizes, faults and records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.draws import DrawnAxis, Plant, draw_limits, rms, with_records
from bayes_hw.plant.drive_train import draw_drive_train
from bayes_hw.plant.effects import CATALOGUE, OFF_CATALOGUES, Effect, Scales
from bayes_hw.plant.kinds import Kind
from bayes_hw.plant.nominal import Nominal, nominal_of
from bayes_hw.plant.run import Axis, Run

HIGHEST_MODE = 0.4
"""Largest frequency of a mode, in sample rates: a simulator may be off and must stay below one half."""


class HomePlant(Plant):
    """The torque-level plant of this package."""

    catalogue = CATALOGUE

    def draw_axis(self, rng: np.random.Generator, kind: Kind) -> DrawnAxis:
        """Axis, sigma and correlation of its noise, excitations (the hold-out's last), duration in s."""
        rate = float(rng.choice(kind.rates_hz))
        duration = float(rng.choice(kind.durations_s))
        drive = draw_drive_train(rng, kind.diameter_m, kind.first_damping)
        while drive.modes()[-1][0] > HIGHEST_MODE * rate:
            drive = draw_drive_train(rng, kind.diameter_m, kind.first_damping)
        speed = kind.speed(rng)
        axis = Axis(drive, *draw_limits(rng, speed), 0.0, int(rng.integers(1, 4)), rate)
        return with_records(rng, kind, axis, nominal_of(axis), duration)

    def nominal_of(self, axis: Axis) -> Nominal:
        """By zero-order hold."""
        return nominal_of(axis)

    def scales(
        self,
        axis: Axis,
        commands: Sequence[FloatArray],
        outputs: Sequence[FloatArray],
        sigma: float,
        duration: float,
    ) -> Scales:
        limit = max(axis.upper, -axis.lower)
        limited = [np.clip(command, axis.lower, axis.upper) for command in commands]
        twist = rms([axis.drive.twist(v, axis.sample_rate_hz) for v in limited])
        first, second = (frequency for frequency, _ in axis.drive.modes())
        return Scales(
            speed=limit * axis.drive.velocity_gain,
            travel=float(np.mean([np.std(y) for y in outputs])) + axis.dead_zone,
            torque=twist * axis.drive.stiffness,
            twist=twist,
            sigma=sigma,
            duration_s=duration,
            sample_rate_hz=axis.sample_rate_hz,
            modes_hz=(first, second),
            limit=limit,
        )

    def unnamed_of(self, kind: Kind) -> tuple[type[Effect], ...]:
        return OFF_CATALOGUES[kind.off_catalogue]

    def begin(self, axis: Axis, command: FloatArray, seed: tuple[int, ...]) -> Run:
        return Run(axis, command, seed)
