"""Axes of finite elements, their sizes, faults and records."""

from __future__ import annotations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.beam.drive import Drive, draw_loop
from bayes_hw.plant.beam.faults import CATALOGUE, UNNAMED
from bayes_hw.plant.beam.mechanism import draw_mechanism
from bayes_hw.plant.beam.simulation import BeamAxis, BeamRun
from bayes_hw.plant.draws import Limits, Plant
from bayes_hw.plant.effects.effect import log_uniform
from bayes_hw.plant.nominal import Nominal, system_of

AT_MOTOR_SHARE = 0.15
HIGHEST_SPRING_HZ = 4.0


class BeamPlant(Plant):
    """Axes of finite elements."""

    catalogue = CATALOGUE
    unnamed = UNNAMED

    def make_axis(self, rng: np.random.Generator, limits: Limits, delay: int, rate: float) -> BeamAxis:
        top_hz = log_uniform(rng, 0.3, 1.0) * min(0.16 * rate, HIGHEST_SPRING_HZ)
        mechanism = draw_mechanism(rng, top_hz)
        drive = Drive(mechanism, draw_loop(rng, mechanism, top_hz), bool(rng.random() < AT_MOTOR_SHARE))
        return BeamAxis(drive, *limits, 0.0, delay, rate)

    def nominal_of(self, axis: BeamAxis) -> Nominal:
        """By zero-order hold."""
        return system_of(axis, *axis.drive.sampled(axis.sample_rate_hz))

    def begin(self, axis: BeamAxis, command: FloatArray, seed: tuple[int, ...]) -> BeamRun:
        return BeamRun(axis, command, seed)

    def inertia_and_stiffness(self, axis: BeamAxis) -> tuple[float, float]:
        """Torques are those that accelerate all of the axis."""
        body = axis.drive.mechanism
        return body.total_inertia, body.mesh[2] * len(body.motors)
