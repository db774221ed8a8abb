"""Axes of finite elements, their sizes, faults and records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.beam.drive import Drive, draw_loop
from bayes_hw.plant.beam.faults import CATALOGUE, UNNAMED
from bayes_hw.plant.beam.mechanism import draw_mechanism
from bayes_hw.plant.beam.simulation import BeamAxis, BeamRun
from bayes_hw.plant.case import UnreachableGapError, draw_excitations, rms, typical_spread
from bayes_hw.plant.effects.effect import Effect, Scales, log_uniform
from bayes_hw.plant.excitation import Excitation
from bayes_hw.plant.kinds import Kind
from bayes_hw.plant.nominal import Nominal
from bayes_hw.plant.run import Reading
from bayes_hw.plant.sampled_system import UnfitAxisError, system_of

AXIS_ATTEMPTS = 400
AT_MOTOR_SHARE = 0.15
HIGHEST_SPRING_HZ = 4.0


class BeamPlant:
    """Draws axes of finite elements and runs them."""

    def draw_axis(
        self, rng: np.random.Generator, kind: Kind
    ) -> tuple[BeamAxis, float, float, tuple[Excitation, ...], float]:
        """Axis, sigma and correlation of its noise, excitations (the hold-out's last), duration in s."""
        rate = float(rng.choice(kind.rates_hz))
        duration = float(rng.choice(kind.durations_s))
        speed = kind.speed(rng)
        lower, upper = -float(rng.uniform(0.28, 0.5)) * speed, float(rng.uniform(0.28, 0.5)) * speed
        delay = int(rng.integers(0, 4))
        for _ in range(AXIS_ATTEMPTS):
            top_hz = log_uniform(rng, 0.3, 1.0) * min(0.16 * rate, HIGHEST_SPRING_HZ)
            mechanism = draw_mechanism(rng, top_hz)
            drive = Drive(mechanism, draw_loop(rng, mechanism, top_hz), bool(rng.random() < AT_MOTOR_SHARE))
            axis = BeamAxis(drive, lower, upper, 0.0, delay, rate)
            try:
                system = self.nominal_of(axis)
            except UnfitAxisError:
                continue
            break
        else:
            raise UnreachableGapError("no stable axis")
        excitations = draw_excitations(rng, kind)
        spread = typical_spread(system, axis, rng, excitations[:-1], duration)
        axis = replace(axis, dead_zone=log_uniform(rng, *kind.dead_zone_share) * spread)
        sigma = log_uniform(rng, *kind.noise_share) * spread
        correlation = float(rng.uniform(0.3, 0.85)) if rng.random() < kind.coloured_share else 0.0
        return axis, sigma, correlation, excitations, duration

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
        faults = UNNAMED if label == "other" else [fault for fault in CATALOGUE if fault.label == label]
        return faults[int(rng.integers(len(faults)))].draw(rng, scales)

    def run(
        self,
        axis: BeamAxis,
        command: FloatArray,
        seed: tuple[int, ...],
        acting: Sequence[tuple[Effect, float]],
    ) -> Reading:
        """One record under these faults of these strengths."""
        run = BeamRun(axis, command, seed)
        for effect, strength in acting:
            effect.act(run, strength)
        return run.read(run.angles())
