"""What axes of every kind are drawn with: records, sizes of noise and dead zone, faults and readings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.effects.effect import Effect, Scales, log_uniform
from bayes_hw.plant.excitation import FAMILIES, Excitation
from bayes_hw.plant.kinds import Kind
from bayes_hw.plant.nominal import Nominal
from bayes_hw.plant.run import LimitedAxis, Reading, RecordRun
from bayes_hw.plant.sampled_system import UnfitAxisError

AXIS_ATTEMPTS = 400

DrawnAxis: TypeAlias = tuple[Any, float, float, tuple[Excitation, ...], float]
"""Axis, sigma and correlation of its noise, excitations (the hold-out's last), duration in s."""


class UnreachableGapError(RuntimeError):
    """No strength of any shape that was drawn leaves a gap of the wanted size."""


def stable_axis(make: Callable[[], Any], nominal_of: Callable[[Any], Nominal]) -> tuple[Any, Nominal]:
    """The first of the axes that `make` draws which a case can state, and its system; raises
    UnreachableGapError after AXIS_ATTEMPTS."""
    for _ in range(AXIS_ATTEMPTS):
        axis = make()
        try:
            return axis, nominal_of(axis)
        except UnfitAxisError:
            continue
    raise UnreachableGapError("no stable axis")


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


def draw_limits(rng: np.random.Generator, speed: float) -> tuple[float, float]:
    """Lower and upper limit (deg/s) of commands about `speed`."""
    return -float(rng.uniform(0.28, 0.5)) * speed, float(rng.uniform(0.28, 0.5)) * speed


def draw_fault(
    rng: np.random.Generator,
    label: str,
    scales: Scales,
    catalogue: Sequence[type[Effect]],
    unnamed: Sequence[type[Effect]],
) -> Effect:
    """That of `label` in `catalogue`, `other` from those `unnamed`; raises KeyError where it has none."""
    if label == "other":
        return unnamed[int(rng.integers(len(unnamed)))].draw(rng, scales)
    for effect in catalogue:
        if effect.label == label:
            return effect.draw(rng, scales)
    raise KeyError(label)


def read_under(run: RecordRun, acting: Sequence[tuple[Effect, float]]) -> Reading:
    """The reading of a record under these faults of these strengths."""
    for effect, strength in acting:
        effect.act(run, strength)
    return run.read(run.angles())


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
