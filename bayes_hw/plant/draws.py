"""What axes of every kind are drawn with: records, sizes of noise and dead zone, faults and readings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar, TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.effects.effect import Effect, Scales, log_uniform
from bayes_hw.plant.excitation import FAMILIES, Excitation
from bayes_hw.plant.kinds import Kind
from bayes_hw.plant.nominal import Nominal, UnfitAxisError
from bayes_hw.plant.run import LimitedAxis, Reading, RecordRun

AXIS_ATTEMPTS = 400

Limits: TypeAlias = tuple[float, float]
"""Lower and upper, deg/s."""

DrawnAxis: TypeAlias = tuple[Any, float, float, tuple[Excitation, ...], float]
"""Axis, sigma and correlation of its noise, excitations (the hold-out's last), duration in s."""


class UnreachableGapError(RuntimeError):
    """No strength of any shape that was drawn leaves a gap of the wanted size."""


def with_records(
    rng: np.random.Generator, kind: Kind, axis: Any, system: Nominal, duration: float
) -> DrawnAxis:
    """`axis` with a dead zone, excitations and noise, of the sizes that `kind` asks for beside the outputs of
    `system`."""
    excitations = draw_excitations(rng, kind)
    spread = typical_spread(system, axis, rng, excitations[:-1], duration)
    axis = replace(axis, dead_zone=log_uniform(rng, *kind.dead_zone_share) * spread)
    sigma = log_uniform(rng, *kind.noise_share) * spread
    correlation = float(rng.uniform(0.3, 0.85)) if rng.random() < kind.coloured_share else 0.0
    return axis, sigma, correlation, excitations, duration


def draw_limits(rng: np.random.Generator, speed: float) -> Limits:
    """Lower and upper limit (deg/s) of commands about `speed`."""
    return -float(rng.uniform(0.28, 0.5)) * speed, float(rng.uniform(0.28, 0.5)) * speed


def draw_excitations(rng: np.random.Generator, kind: Kind) -> tuple[Excitation, ...]:
    """Those of the training records and, last, the hold-out's."""
    if kind.excitations:
        return tuple(FAMILIES[name] for name in kind.excitations)
    names = list(FAMILIES)
    train = rng.choice(names, int(rng.integers(2, 4)), replace=False)
    return (*(FAMILIES[str(name)] for name in train), FAMILIES[str(rng.choice(names))])


def typical_spread(
    system: Nominal,
    axis: LimitedAxis,
    rng: np.random.Generator,
    excitations: Sequence[Excitation],
    duration: float,
) -> float:
    """Mean standard deviation of the outputs to commands like those of the records."""
    samples = round(duration * axis.sample_rate_hz)
    limit = max(axis.upper, -axis.lower)
    outputs = [system.simulate(limit * make(rng, axis.sample_rate_hz, samples)) for make in excitations]
    return float(np.mean([np.std(y) for y in outputs]))


def draw_commands(
    rng: np.random.Generator, axis: LimitedAxis, excitations: Sequence[Excitation], duration: float
) -> list[FloatArray]:
    samples = round(duration * axis.sample_rate_hz)
    limit = max(axis.upper, -axis.lower)
    return [np.round(limit * make(rng, axis.sample_rate_hz, samples), 6) for make in excitations]


def rms(parts: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


class Plant:
    """What makes the axes of a kind and their records.

    A plant says what its axis, system and record are; sizes are those of what turns behind the gear.
    """

    catalogue: ClassVar[tuple[type[Effect], ...]]
    unnamed: ClassVar[tuple[type[Effect], ...]]

    def make_axis(self, rng: np.random.Generator, limits: Limits, delay: int, rate: float) -> Any:
        """Without a dead zone."""
        raise NotImplementedError

    def nominal_of(self, axis: Any) -> Nominal:
        """The system that the axis is without faults; raises UnfitAxisError."""
        raise NotImplementedError

    def begin(self, axis: Any, command: FloatArray, seed: tuple[int, ...]) -> RecordRun:
        """A record without faults, not yet run."""
        raise NotImplementedError

    def inertia_and_stiffness(self, axis: Any) -> tuple[float, float]:
        """Of what the gear turns, and of the gear."""
        raise NotImplementedError

    def draw_axis(self, rng: np.random.Generator, kind: Kind) -> DrawnAxis:
        """The first axis that a case can state, with its records; raises UnreachableGapError after
        AXIS_ATTEMPTS."""
        rate = float(rng.choice(kind.rates_hz))
        duration = float(rng.choice(kind.durations_s))
        limits = draw_limits(rng, kind.speed(rng))
        delay = int(rng.integers(0, 4))
        for _ in range(AXIS_ATTEMPTS):
            axis = self.make_axis(rng, limits, delay, rate)
            try:
                return with_records(rng, kind, axis, self.nominal_of(axis), duration)
            except UnfitAxisError:
                continue
        raise UnreachableGapError("no stable axis")

    def scales(
        self,
        axis: Any,
        commands: Sequence[FloatArray],  # noqa: ARG002
        outputs: Sequence[FloatArray],
        sigma: float,
        duration: float,
    ) -> Scales:
        """Sizes natural to the axis and its records."""
        rate, (inertia, stiffness) = axis.sample_rate_hz, self.inertia_and_stiffness(axis)
        speeds = [np.gradient(w) * rate for w in outputs]
        torque = inertia * rms([np.gradient(s) * rate for s in speeds])
        modes = [f for f, _ in self.nominal_of(axis).modes]
        return Scales(
            speed=float(np.quantile(np.abs(np.concatenate(speeds)), 0.98)),
            travel=float(np.mean([np.std(y) for y in outputs])) + axis.dead_zone,
            torque=torque,
            twist=torque / stiffness,
            sigma=sigma,
            duration_s=duration,
            sample_rate_hz=rate,
            modes_hz=(modes[0], modes[-1]),
            limit=max(axis.upper, -axis.lower),
        )

    def unnamed_of(self, kind: Kind) -> tuple[type[Effect], ...]:  # noqa: ARG002
        return self.unnamed

    def draw_effect(self, rng: np.random.Generator, kind: Kind, label: str, scales: Scales) -> Effect:
        """A fault of this label, `other` from those without a name; raises KeyError where there is none."""
        if label == "other":
            unnamed = self.unnamed_of(kind)
            return unnamed[int(rng.integers(len(unnamed)))].draw(rng, scales)
        for effect in self.catalogue:
            if effect.label == label:
                return effect.draw(rng, scales)
        raise KeyError(label)

    def run(
        self, axis: Any, command: FloatArray, seed: tuple[int, ...], acting: Sequence[tuple[Effect, float]]
    ) -> Reading:
        """One record under these faults of these strengths."""
        run = self.begin(axis, command, seed)
        for effect, strength in acting:
            effect.act(run, strength)
        return run.read(run.angles())
