"""Axes of finite elements, their sizes, faults and records."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.beam.drive import Drive, draw_loop
from bayes_hw.plant.beam.faults import CATALOGUE, UNNAMED
from bayes_hw.plant.beam.mechanism import draw_mechanism
from bayes_hw.plant.beam.simulation import BeamAxis, BeamRun
from bayes_hw.plant.draws import (
    DrawnAxis,
    draw_fault,
    draw_limits,
    read_under,
    rms,
    stable_axis,
    with_records,
)
from bayes_hw.plant.effects.effect import Effect, Scales, log_uniform
from bayes_hw.plant.kinds import Kind
from bayes_hw.plant.nominal import Nominal
from bayes_hw.plant.run import Reading
from bayes_hw.plant.sampled_system import system_of

AT_MOTOR_SHARE = 0.15
HIGHEST_SPRING_HZ = 4.0


class BeamPlant:
    """Draws axes of finite elements and runs them."""

    def draw_axis(self, rng: np.random.Generator, kind: Kind) -> DrawnAxis:
        """Axis, sigma and correlation of its noise, excitations (the hold-out's last), duration in s."""
        rate = float(rng.choice(kind.rates_hz))
        duration = float(rng.choice(kind.durations_s))
        lower, upper = draw_limits(rng, kind.speed(rng))
        delay = int(rng.integers(0, 4))

        def make() -> BeamAxis:
            top_hz = log_uniform(rng, 0.3, 1.0) * min(0.16 * rate, HIGHEST_SPRING_HZ)
            mechanism = draw_mechanism(rng, top_hz)
            drive = Drive(mechanism, draw_loop(rng, mechanism, top_hz), bool(rng.random() < AT_MOTOR_SHARE))
            return BeamAxis(drive, lower, upper, 0.0, delay, rate)

        axis, system = stable_axis(make, self.nominal_of)
        return with_records(rng, kind, axis, system, duration)

    def nominal_of(self, axis: BeamAxis) -> Nominal:
        """By zero-order hold."""
        return system_of(axis, *axis.drive.sampled(axis.sample_rate_hz))

    def scales(
        self,
        axis: BeamAxis,
        commands: Sequence[FloatArray],  # noqa: ARG002
        outputs: Sequence[FloatArray],
        sigma: float,
        duration: float,
    ) -> Scales:
        """Torques are those that accelerate all of the axis."""
        rate, body = axis.sample_rate_hz, axis.drive.mechanism
        speeds = [np.gradient(w) * rate for w in outputs]
        torque = body.total_inertia * rms([np.gradient(s) * rate for s in speeds])
        modes = [f for f, _ in self.nominal_of(axis).modes]
        return Scales(
            speed=float(np.quantile(np.abs(np.concatenate(speeds)), 0.98)),
            travel=float(np.mean([np.std(y) for y in outputs])) + axis.dead_zone,
            torque=torque,
            twist=torque / (body.mesh[2] * len(body.motors)),
            sigma=sigma,
            duration_s=duration,
            sample_rate_hz=rate,
            modes_hz=(modes[0], modes[-1]),
            limit=max(axis.upper, -axis.lower),
        )

    def draw_effect(
        self,
        rng: np.random.Generator,
        kind: Kind,  # noqa: ARG002
        label: str,
        scales: Scales,
    ) -> Effect:
        """A fault of this label, `other` from those without a name."""
        return draw_fault(rng, label, scales, CATALOGUE, UNNAMED)

    def run(
        self,
        axis: BeamAxis,
        command: FloatArray,
        seed: tuple[int, ...],
        acting: Sequence[tuple[Effect, float]],
    ) -> Reading:
        """One record under these faults of these strengths."""
        return read_under(BeamRun(axis, command, seed), acting)
