"""One withheld case: an axis, its records, none to two faults, and a simulator that is slightly wrong."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.drive_train import draw_drive_train
from bayes_hw.plant.effects import CATALOGUE, OFF_CATALOGUE, Effect, Scales
from bayes_hw.plant.effects.effect import log_uniform
from bayes_hw.plant.excitation import FAMILIES, TRAINING, Excitation, acceptance_run
from bayes_hw.plant.kinds import Kind
from bayes_hw.plant.nominal import Nominal, nominal_of, refit
from bayes_hw.plant.run import Axis, Reading, Run
from bayes_hw.plant.strength import strength_for_gap

DRAW_ATTEMPTS = 12
"""Shapes of a fault tried before another one whose gap can be set is drawn."""

NOISE_STREAM = 7


@dataclass(frozen=True, eq=False)
class BlindRecord:
    """A record of the case and what only the truth knows of it, all of shape (samples,).

    `noise_free` is the angle as the encoder sees it: without noise, drift, glitches and rounding;
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

    Same arguments, same case.
    """
    rng = np.random.default_rng([seed, index])
    axis, sigma, correlation, excitations, duration = _draw_axis(rng, kind)
    commands = _draw_commands(rng, axis, excitations, duration)
    true = nominal_of(axis)
    chosen = kind.draw_labels(rng) if labels is None else list(labels)
    train = range(len(commands) - 1)
    clean = [true.simulate(u) for u in commands]
    scales = _scales(axis, [commands[i] for i in train], [clean[i] for i in train], sigma, duration)

    effects: list[Effect] = []
    strengths: list[float] = []
    gaps: list[float] = []
    for label in chosen:
        for _ in range(DRAW_ATTEMPTS):
            effect = _draw_effect(rng, label, scales)
            target = log_uniform(rng, *kind.gap_over_sigma) * sigma

            def outputs(strength: float, effect: Effect = effect) -> list[FloatArray]:
                return [
                    _run(axis, commands[i], (seed, index, i), [(effect, strength)]).measured() for i in train
                ]

            strength, reached = strength_for_gap(RefittedGap(true, commands[:-1], outputs), target)
            if kind.gap_over_sigma[0] * sigma * 0.95 <= reached <= kind.gap_over_sigma[1] * sigma * 1.05:
                break
        else:
            raise RuntimeError(
                f"no {label} of the wanted size in {DRAW_ATTEMPTS} draws (seed {seed}, case {index})"
            )
        effects.append(effect)
        strengths.append(strength)
        gaps.append(reached / sigma)

    acting = list(zip(effects, strengths, strict=True))
    readings = [_run(axis, u, (seed, index, i), acting) for i, u in enumerate(commands)]
    records = [
        _record(
            name,
            u,
            reading,
            _noise(np.random.default_rng([seed, index, i, NOISE_STREAM]), sigma, correlation, u),
        )
        for i, (name, u, reading) in enumerate(zip(_names(len(commands)), commands, readings, strict=True))
    ]
    fitted = refit(true, commands[:-1], [reading.measured() for reading in readings[:-1]])
    simulator = kind.misjudge(rng, true)
    truth: dict[str, object] = {
        "effects": [effect.label for effect in effects],
        "detail": [effect.detail if effect.label == "other" else effect.label for effect in effects],
        "form": [effect.detail for effect in effects],
        "strength": strengths,
        "gap_over_sigma": gaps,
        "params": [effect.parameters(strength) for effect, strength in acting],
        "base": _truth_base(true, sigma),
        "seed": seed,
        "index": index,
        "rho": correlation,
        "kind": kind.name,
        "excitation": [function.__name__ for function in excitations],
        "gap_rms": {
            "train": _rms([fitted.simulate(r.command) - r.without_noise for r in records[:-1]]),
            "holdout": _rms([fitted.simulate(records[-1].command) - records[-1].without_noise]),
        },
    }
    return BlindCase(simulator, sigma * kind.misjudged_sigma(rng), tuple(records[:-1]), records[-1], truth)


class RefittedGap:
    """What a refitted simulator leaves of a fault of some strength, as root mean square in deg.

    Each fit begins where the last one ended; `outputs` gives the faulty training outputs at a strength.
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
        self._fitted = refit(self._true, self._commands, measured, self._fitted)
        return _rms([self._fitted.simulate(u) - y for u, y in zip(self._commands, measured, strict=True)])


def _draw_axis(
    rng: np.random.Generator, kind: Kind
) -> tuple[Axis, float, float, tuple[Excitation, ...], float]:
    """Axis, sigma and correlation of its noise, excitations (the hold-out's last), duration in s."""
    rate = float(rng.choice(kind.rates_hz))
    duration = float(rng.choice(kind.durations_s))
    drive = draw_drive_train(rng, kind.diameter_m, kind.first_damping)
    axis = Axis(
        drive,
        -float(rng.uniform(0.28, 0.5)) * kind.speed(rng),
        float(rng.uniform(0.28, 0.5)) * kind.speed(rng),
        0.0,
        int(rng.integers(1, 4)),
        rate,
    )
    if kind.every_excitation:
        names = list(FAMILIES)
        number = int(rng.integers(2, 4))
        train = tuple(FAMILIES[name] for name in rng.choice(names, number, replace=False))
        excitations = (*train, FAMILIES[str(rng.choice(names))])
    else:
        excitations = (*TRAINING, acceptance_run)
    spread = _typical_spread(axis, rng, excitations[:-1], duration)
    axis = replace(axis, dead_zone=log_uniform(rng, *kind.dead_zone_share) * spread)
    sigma = log_uniform(rng, *kind.noise_share) * spread
    correlation = float(rng.uniform(0.3, 0.85)) if rng.random() < kind.coloured_share else 0.0
    return axis, sigma, correlation, excitations, duration


def _typical_spread(
    axis: Axis, rng: np.random.Generator, excitations: Sequence[Excitation], duration: float
) -> float:
    """Mean standard deviation of the outputs to commands like those of the records."""
    system = nominal_of(axis)
    samples = round(duration * axis.sample_rate_hz)
    limit = max(axis.upper, -axis.lower)
    outputs = [system.simulate(limit * make(rng, axis.sample_rate_hz, samples)) for make in excitations]
    return float(np.mean([np.std(y) for y in outputs]))


def _draw_commands(
    rng: np.random.Generator, axis: Axis, excitations: Sequence[Excitation], duration: float
) -> list[FloatArray]:
    samples = round(duration * axis.sample_rate_hz)
    limit = max(axis.upper, -axis.lower)
    return [np.round(limit * make(rng, axis.sample_rate_hz, samples), 6) for make in excitations]


def _scales(
    axis: Axis, commands: Sequence[FloatArray], outputs: Sequence[FloatArray], sigma: float, duration: float
) -> Scales:
    limit = max(axis.upper, -axis.lower)
    limited = [np.clip(command, axis.lower, axis.upper) for command in commands]
    twist = _rms([axis.drive.twist(v, axis.sample_rate_hz) for v in limited])
    first, second = (frequency for frequency, _ in axis.drive.modes())
    return Scales(
        speed=limit * axis.drive.velocity_gain,
        travel=float(np.mean([np.std(y) for y in outputs])) + axis.dead_zone,
        torque=twist * axis.drive.stiffness,
        twist=twist,
        dead_zone=axis.dead_zone,
        sigma=sigma,
        duration_s=duration,
        sample_rate_hz=axis.sample_rate_hz,
        modes_hz=(first, second),
        limit=limit,
    )


def _draw_effect(rng: np.random.Generator, label: str, scales: Scales) -> Effect:
    if label == "other":
        return OFF_CATALOGUE[int(rng.integers(len(OFF_CATALOGUE)))].draw(rng, scales)
    for effect in CATALOGUE:
        if effect.label == label:
            return effect.draw(rng, scales)
    raise KeyError(label)


def _run(
    axis: Axis, command: FloatArray, seed: tuple[int, ...], acting: Sequence[tuple[Effect, float]]
) -> Reading:
    run = Run(axis, command, seed)
    for effect, strength in acting:
        effect.act(run, strength)
    return run.read(run.angles())


def _record(name: str, command: FloatArray, reading: Reading, noise: FloatArray) -> BlindRecord:
    return BlindRecord(name, command, reading.measured(noise), reading.angle, reading.measured())


def _noise(rng: np.random.Generator, sigma: float, correlation: float, command: FloatArray) -> FloatArray:
    """Stationary AR(1) noise of marginal standard deviation `sigma`."""
    white = rng.standard_normal(len(command)) * np.sqrt(1 - correlation**2)
    white[0] /= np.sqrt(1 - correlation**2)
    return sigma * np.asarray(signal.lfilter([1.0], [1.0, -correlation], white), dtype=np.float64)


def _names(count: int) -> list[str]:
    return [*(f"train_{number}" for number in range(1, count)), "holdout"]


def _truth_base(true: Nominal, sigma: float) -> dict[str, float]:
    base = true.base(sigma)
    return base | {"sigma": sigma}


def _rms(parts: Sequence[FloatArray]) -> float:
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
