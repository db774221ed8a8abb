"""Axes of MuJoCo, their sizes, faults and records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.case import UnreachableGapError, draw_excitations, rms, typical_spread
from bayes_hw.plant.effects.command import CommandBias, GainDrift, RateLimit, SaturationDrift
from bayes_hw.plant.effects.disturbance import Wind
from bayes_hw.plant.effects.effect import Effect, Scales, log_uniform
from bayes_hw.plant.effects.linear import TransportDelay
from bayes_hw.plant.effects.sensor import (
    Eccentricity,
    GainAsymmetry,
    Outliers,
    Quantization,
    SensorDrift,
    TimingJitter,
)
from bayes_hw.plant.excitation import Excitation
from bayes_hw.plant.foreign.linearisation import nominal_of
from bayes_hw.plant.foreign.mechanics import Backlash, CubicSpring, Friction, FurtherMode, Ripple
from bayes_hw.plant.foreign.simulation import ForeignAxis, ForeignRun, substeps_for
from bayes_hw.plant.foreign.train import draw_train
from bayes_hw.plant.foreign.unnamed import UNNAMED
from bayes_hw.plant.kinds import Kind
from bayes_hw.plant.nominal import Nominal
from bayes_hw.plant.run import Reading
from bayes_hw.plant.sampled_system import UnfitAxisError

CATALOGUE: tuple[type[Effect], ...] = (
    RateLimit,
    SaturationDrift,
    CommandBias,
    GainDrift,
    TransportDelay,
    FurtherMode,
    CubicSpring,
    Friction,
    Backlash,
    Ripple,
    Wind,
    Quantization,
    Eccentricity,
    SensorDrift,
    TimingJitter,
    GainAsymmetry,
    Outliers,
)

HIGHEST_MODE = 0.35
AXIS_ATTEMPTS = 400


class ForeignPlant:
    """Draws MuJoCo axes and runs them."""

    def draw_axis(
        self, rng: np.random.Generator, kind: Kind
    ) -> tuple[ForeignAxis, float, float, tuple[Excitation, ...], float]:
        """Axis, sigma and correlation of its noise, excitations (the hold-out's last), duration in s."""
        rate = float(rng.choice(kind.rates_hz))
        duration = float(rng.choice(kind.durations_s))
        speed = kind.speed(rng)
        lower = -float(rng.uniform(0.28, 0.5)) * speed
        upper = float(rng.uniform(0.28, 0.5)) * speed
        delay = int(rng.integers(0, 4))
        for _ in range(AXIS_ATTEMPTS):
            train = draw_train(rng, min(HIGHEST_MODE * rate, 9.0))
            axis = ForeignAxis(train, lower, upper, 0.0, delay, rate, substeps_for(train, rate))
            try:
                system = nominal_of(axis)
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

    def nominal_of(self, axis: ForeignAxis) -> Nominal:
        """By steps of the simulation itself."""
        return nominal_of(axis)

    def scales(
        self,
        axis: ForeignAxis,
        commands: Sequence[FloatArray],  # noqa: ARG002
        outputs: Sequence[FloatArray],
        sigma: float,
        duration: float,
    ) -> Scales:
        """Torques in deg/s^2 of a load of 1 kg m^2: those that accelerate what hangs on the gear's spring."""
        limit = max(axis.upper, -axis.lower)
        rate, train = axis.sample_rate_hz, axis.train
        speeds = [np.gradient(w) * rate for w in outputs]
        torque = train.inertia * rms([np.gradient(s) * rate for s in speeds])
        modes = [f for f, _ in nominal_of(axis).modes]
        stiffness = train.springs[train.gear].stiffness
        return Scales(
            speed=float(np.quantile(np.abs(np.concatenate(speeds)), 0.98)),
            travel=float(np.mean([np.std(y) for y in outputs])) + axis.dead_zone,
            torque=torque,
            twist=torque / stiffness,
            sigma=sigma,
            duration_s=duration,
            sample_rate_hz=rate,
            modes_hz=(modes[0], modes[-1]),
            limit=limit,
        )

    def draw_effect(
        self,
        rng: np.random.Generator,
        kind: Kind,  # noqa: ARG002
        label: str,
        scales: Scales,
    ) -> Effect:
        """A fault of this label, `other` from those of MuJoCo axes."""
        if label == "other":
            return UNNAMED[int(rng.integers(len(UNNAMED)))].draw(rng, scales)
        for effect in CATALOGUE:
            if effect.label == label:
                return effect.draw(rng, scales)
        raise KeyError(label)

    def run(
        self,
        axis: ForeignAxis,
        command: FloatArray,
        seed: tuple[int, ...],
        acting: Sequence[tuple[Effect, float]],
    ) -> Reading:
        """One record under these faults of these strengths."""
        run = ForeignRun(axis, command, seed)
        for effect, strength in acting:
            effect.act(run, strength)
        return run.read(run.angles())
