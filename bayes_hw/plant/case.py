"""One withheld case: an axis, its records, none to two faults, and a simulator that is slightly wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.draws import Plant, UnreachableGapError, draw_commands, rms
from bayes_hw.plant.effects import Effect, Scales
from bayes_hw.plant.effects.effect import log_uniform, strength_for_gap
from bayes_hw.plant.kinds import Kind
from bayes_hw.plant.nominal import Nominal, refit

SHAPE_ATTEMPTS = 6
"""Shapes of a fault tried before another axis is drawn."""

CASE_ATTEMPTS = 12

NOISE_STREAM = 7


@dataclass(frozen=True, eq=False)
class BlindRecord:
    """A record of the case and what only the truth knows of it, all of shape (samples,).

    `noise_free` is the angle at the instants that are shown: without noise, drift, glitches and rounding;
    `without_noise` lacks the noise alone.
    """

    name: str
    command: FloatArray
    measured: FloatArray
    noise_free: FloatArray
    without_noise: FloatArray


@dataclass(frozen=True, eq=False)
class BlindCase:
    """A case with its truth."""

    simulator: Nominal
    simulator_sigma: float
    train: tuple[BlindRecord, ...]
    holdout: BlindRecord
    truth: dict[str, object]


def make_case(seed: int, index: int, kind: Kind, labels: Sequence[str] | None = None) -> BlindCase:
    """Case `index` of the set of `seed`; `labels` names the faults instead of drawing their number and names.

    Same arguments, same case. Where these records cannot show the fault at the wanted size (limits that move
    need commands that reach them), another axis and other commands are drawn. Raises UnreachableGapError when
    that has failed CASE_ATTEMPTS times.
    """
    rng = np.random.default_rng([seed, index])
    plant = _plant(kind)
    chosen = kind.draw_labels(rng) if labels is None else list(labels)
    for attempt in range(CASE_ATTEMPTS):
        try:
            return _attempt(plant, np.random.default_rng([seed, index, attempt]), (seed, index), kind, chosen)
        except UnreachableGapError:
            if attempt == CASE_ATTEMPTS - 1:
                raise
    raise AssertionError("unreachable")


def _plant(kind: Kind) -> Plant:
    if kind.plant == "mujoco":
        from bayes_hw.plant.foreign.plant import ForeignPlant

        return ForeignPlant()
    if kind.plant == "beam":
        from bayes_hw.plant.beam.plant import BeamPlant

        return BeamPlant()
    from bayes_hw.plant.home import HomePlant

    return HomePlant()


def _attempt(
    plant: Plant, rng: np.random.Generator, identity: tuple[int, int], kind: Kind, labels: Sequence[str]
) -> BlindCase:
    """One axis with its records; raises UnreachableGapError where it cannot show the faults."""
    axis, sigma, correlation, excitations, duration = plant.draw_axis(rng, kind)
    commands = draw_commands(rng, axis, excitations, duration)
    true = plant.nominal_of(axis)
    clean = [true.simulate(u) for u in commands[:-1]]
    scales = plant.scales(axis, commands[:-1], clean, sigma, duration)
    found = [
        _sized_effect(plant, rng, identity, kind, label, axis, true, commands[:-1], scales)
        for label in labels
    ]
    acting = [(effect, strength) for effect, strength, _ in found]
    readings = [plant.run(axis, u, (*identity, i), acting) for i, u in enumerate(commands)]
    noises = [
        _noise(np.random.default_rng([*identity, i, NOISE_STREAM]), sigma, correlation, len(u))
        for i, u in enumerate(commands)
    ]
    records = [
        BlindRecord(name, u, reading.measured(noise), reading.noise_free, reading.measured())
        for name, u, reading, noise in zip(_names(len(commands)), commands, readings, noises, strict=True)
    ]
    fitted = refit(true, commands[:-1], [record.without_noise for record in records[:-1]])
    simulator = kind.misjudge(rng, true)
    effects = [effect for effect, _ in acting]
    truth: dict[str, object] = {
        "effects": [effect.label for effect in effects],
        "detail": [effect.detail if effect.label == "other" else effect.label for effect in effects],
        "form": [f"{effect.label}: {effect.detail}" for effect in effects],
        "strength": [strength for _, strength in acting],
        "gap_over_sigma": [gap / sigma for _, _, gap in found],
        "params": [effect.parameters(strength) for effect, strength in acting],
        "base": true.base(sigma) | {"sigma": sigma},
        "seed": identity[0],
        "index": identity[1],
        "rho": correlation,
        "kind": kind.name,
        "excitation": [function.__name__ for function in excitations],
        "gap_rms": {
            "train": rms([fitted.simulate(r.command) - r.without_noise for r in records[:-1]]),
            "holdout": rms([fitted.simulate(records[-1].command) - records[-1].without_noise]),
        },
    }
    sigma_said = sigma * kind.misjudged_sigma(rng)
    return BlindCase(simulator, sigma_said, tuple(records[:-1]), records[-1], truth)


def _sized_effect(
    plant: Plant,
    rng: np.random.Generator,
    identity: tuple[int, int],
    kind: Kind,
    label: str,
    axis: Any,
    true: Nominal,
    commands: Sequence[FloatArray],
    scales: Scales,
) -> tuple[Effect, float, float]:
    """A fault of this label, its strength and the gap in deg that it leaves; raises UnreachableGapError."""
    smallest, largest = (bound * scales.sigma for bound in kind.gap_over_sigma)
    for _ in range(SHAPE_ATTEMPTS):
        effect = plant.draw_effect(rng, kind, label, scales)
        target = log_uniform(rng, smallest, largest)

        def outputs(strength: float, effect: Effect = effect) -> list[FloatArray]:
            return [
                plant.run(axis, u, (*identity, i), [(effect, strength)]).measured()
                for i, u in enumerate(commands)
            ]

        strength, gap = strength_for_gap(RefittedGap(true, commands, outputs), target, effect.largest)
        gap = min(gap, RefittedGap(true, commands, outputs)(strength))
        if 0.95 * smallest <= gap <= 1.05 * largest:
            return effect, strength, gap
    raise UnreachableGapError(f"no {label} of the wanted size (seed {identity[0]}, case {identity[1]})")


class RefittedGap:
    """What a refitted simulator leaves of a fault of some strength, as root mean square in deg.

    Each fit begins where the last one ended, or at the true axis where that is nearer to the records: a
    strong fault can bend the simulator so far that a weak one would not bring it back. `outputs` gives the
    faulty training outputs at a strength.
    """

    def __init__(
        self, true: Nominal, commands: Sequence[FloatArray], outputs: Callable[[float], list[FloatArray]]
    ) -> None:
        self._true, self._fitted = true, true
        self._commands, self._outputs = commands, outputs

    def __call__(self, strength: float) -> float:
        measured = self._outputs(strength)
        if not all(np.isfinite(y).all() for y in measured):
            return float("inf")
        start = min((self._true, self._fitted), key=lambda one: self._left(one, measured))
        self._fitted = refit(self._true, self._commands, measured, start)
        return self._left(self._fitted, measured)

    def _left(self, simulator: Nominal, measured: Sequence[FloatArray]) -> float:
        return rms([simulator.simulate(u) - y for u, y in zip(self._commands, measured, strict=True)])


def _noise(rng: np.random.Generator, sigma: float, correlation: float, samples: int) -> FloatArray:
    """Stationary AR(1) noise of marginal standard deviation `sigma`."""
    white = rng.standard_normal(samples) * np.sqrt(1 - correlation**2)
    white[0] /= np.sqrt(1 - correlation**2)
    return sigma * np.asarray(signal.lfilter([1.0], [1.0, -correlation], white), dtype=np.float64)


def _names(count: int) -> list[str]:
    return [*(f"train_{number}" for number in range(1, count)), "holdout"]
