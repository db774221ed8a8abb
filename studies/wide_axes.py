"""Axes drawn wide, with commands and records: what a calibration from records alone starts from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from linear_proxy import model_by_linear_proxy
from printed.eq12 import nanshan_rounding_box
from printed.nanshan import SAMPLE_RATE_HZ, nanshan_model
from printed.rounding_box import roots_of_rows, without_integrator
from recovery import recover
from true_axis import KnownAxis, TrueNoise
from twin import twin_records

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.errors import InputError
from bayes_hw.infer.sampler import SamplerSettings
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.excitation import balancing_offset, sine_sweep
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.plant.case import make_case
from bayes_hw.plant.excitation import FAMILIES
from bayes_hw.plant.kinds import KINDS, Spread
from bayes_hw.record import Record

RATES_HZ = (10.0, 500.0)
SAMPLES = (2000, 5000)
"""Of all records of an axis together."""

RECORDS = 2
ORDERS = (3, 12)
MOST_MODES = 3
LONGEST_DELAY_S = 1.0
LONGEST_DELAY_SHARE = 0.06
"""Of a record: no longer delay is drawn."""

TWIN_SHARE = 0.2
"""Of the axes: members of the rounding box of the printed transfer function."""

CLIPPED = (0.003, 0.3)
"""Share of the commands beyond a limit, from hardly to often."""

LEAST_CLIPPED = 0.002
"""A limit that fewer commands exceed is not drawn: nothing could be said of it."""

DEAD_ZONE_SHARE = (0.02, 0.25)
NOISE_SHARE = (0.003, 0.05)
"""Half width and noise as shares of the spread of the output."""

HIGHEST_MODE_HZ = 12.0
DAMPING = (0.01, 0.12)
FORGETTING = 0.25
"""Part of a record within which a mode decays by 1 / e; one that rings on is told from none nowhere."""

CUT = 0.25
"""Of a record that is to begin in motion."""

SLEWS = ("slews_and_tracking",)
OPERATION = ("raster_scan", "steps_and_triangles", "telegraph", "acceptance_run")


@dataclass(frozen=True, eq=False)
class DrawnAxis:
    """A known axis with what it is like: rate, order, modes, delay, noise and commands in words."""

    known: KnownAxis
    facts: dict[str, Any]


def wide_axis(rng: np.random.Generator) -> DrawnAxis:
    """An axis of the rounding box in TWIN_SHARE of the draws, else one whose every root is drawn."""
    return twin_like_axis(rng) if rng.random() < TWIN_SHARE else drawn_axis(rng)


def drawn_axis(rng: np.random.Generator) -> DrawnAxis:
    """Order, modes, delay, rate, noise, commands and limits drawn; again until the commands move it."""
    while True:
        rate = log_uniform(rng, *RATES_HZ)
        samples = int(rng.integers(*SAMPLES)) // RECORDS
        linear, modes = _linear_block(rng, rate, samples / rate)
        family, commands = _commands(rng, rate, samples, modes)
        saturation = _saturation(rng, np.concatenate(commands))
        if linear.smallest_separation < 1e-3 or saturation is None:
            continue
        shares = rng.permutation([float(rng.uniform(0.3, 0.9)), float(rng.uniform(1.1, 1.7))])
        commands = [
            u + share * balancing_offset(u, saturation) for u, share in zip(commands, shares, strict=True)
        ]
        if not _both_met(saturation, np.concatenate(commands)):
            continue
        model = HammersteinWiener("drawn axis", rate, saturation, linear, DeadZone(0.0), tuple(modes))
        spread = float(np.mean([np.std(model.simulate(u).w) for u in commands]))
        model = replace(model, dead_zone=DeadZone(log_uniform(rng, *DEAD_ZONE_SHARE) * spread))
        clean = [model.simulate(u).y for u in commands]
        noise = _noise(rng, log_uniform(rng, *NOISE_SHARE) * float(np.mean([np.std(y) for y in clean])))
        return _with_records(rng, model, noise, commands, {"source": "drawn", "commands": family})


def twin_like_axis(rng: np.random.Generator) -> DrawnAxis:
    """A member of the rounding box of the printed transfer function under the twin's commands."""
    model = replace(nanshan_model(), linear=_rounding_box_member(rng))
    modes = tuple(mode for mode in model.linear.modes(SAMPLE_RATE_HZ) if mode.damping_ratio < 0.1)
    twin = twin_records(np.random.default_rng(0))
    half_width = twin.truth.dead_zone.half_width * log_uniform(rng, 0.6, 1.6)
    model = replace(model, dominant_modes=modes, dead_zone=DeadZone(half_width))
    sigma = twin.truth.noise_sigma * log_uniform(rng, 0.6, 1.3)
    noise = TrueNoise(sigma, (float(rng.uniform(0.3, 0.8)),))
    commands = [record.u for record in twin.train]
    return _with_records(rng, model, noise, commands, {"source": "rounding box", "commands": "sweep"})


def effect_free_axis(seed: int, index: int) -> DrawnAxis:
    """A drive train of masses and springs at 20 Hz without any effect, by a simulator of its own.

    Commands of two or three families for two minutes each; the model is the exact discretization.
    """
    exact = Spread(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, uniform=False)
    kind = replace(KINDS["hard"], rates_hz=(20.0,), durations_s=(120.0,), spread=exact)
    case = make_case(seed, index, kind, labels=[])
    model = HammersteinWiener.from_dict(case.simulator.to_dict("effect-free axis", 0.0))
    correlation = float(case.truth["rho"])  # type: ignore[arg-type]
    base = case.truth["base"]
    assert isinstance(base, dict)
    noise = TrueNoise(base["noise.sigma"], (correlation,) if correlation else ())
    rate = model.sample_rate_hz
    records = tuple(
        Record(r.name, np.arange(len(r.command)) / rate, r.command, r.measured, rate, model.units)
        for r in case.train
    )
    known = KnownAxis(replace(model, noise_sigma=noise.sigma), noise, records)
    return DrawnAxis(
        known, _facts(known) | {"source": "effect-free", "commands": str(case.truth["excitation"])}
    )


def recover_axis(task: Mapping[str, Any]) -> dict[str, Any]:
    """One replicate of the axis that `task` names, see `axis_of_task`, with its facts; plain data.

    `max_order` bounds the search, `free` is what is sampled, for at most `max_steps`. `refused` says why
    where the records gave no posterior. With `linear_proxy` the structure is that of `linear_proxy`; with
    `in_motion` the records begin while the axis moves.
    """
    drawn = axis_of_task(task)
    known = in_motion(drawn.known) if task.get("in_motion") else drawn.known
    sampler_rng = np.random.default_rng([task["seed"], task["index"], 1])
    settings = SamplerSettings(max_steps=task["max_steps"])
    same = {"facts": drawn.facts, "index": task["index"]}
    try:
        found = recover(
            known,
            sampler_rng,
            max_order=task["max_order"],
            free=task["free"],
            settings=settings,
            found_by=model_by_linear_proxy if task.get("linear_proxy") else None,
            start="free" if task.get("in_motion") else "rest",
        )
    except InputError as error:
        return same | {"refused": str(error)}
    return same | found


def in_motion(axis: KnownAxis) -> KnownAxis:
    """The axis with CUT of every record left out at its beginning."""
    records, earlier = [], []
    for record in axis.records:
        first = int(CUT * len(record))
        times = record.t[first:] - record.t[first]
        records.append(replace(record, t=times, u=record.u[first:], y=record.y[first:]))
        earlier.append(record.u[:first])
    return replace(axis, records=tuple(records), earlier=tuple(earlier))


def axis_of_task(task: Mapping[str, Any]) -> DrawnAxis:
    """The axis of a `source` (wide, drawn, twin or effect-free), drawn from `seed` and `index`."""
    if task["source"] == "effect-free":
        return effect_free_axis(task["seed"], task["index"])
    draw = {"wide": wide_axis, "drawn": drawn_axis, "twin": twin_like_axis}[task["source"]]
    return draw(np.random.default_rng([task["seed"], task["index"]]))


def _with_records(
    rng: np.random.Generator,
    model: HammersteinWiener,
    noise: TrueNoise,
    commands: list[FloatArray],
    facts: dict[str, Any],
) -> DrawnAxis:
    rate = model.sample_rate_hz
    model = replace(model, noise_sigma=noise.sigma)
    records = tuple(
        Record(
            f"record_{number}",
            np.arange(len(u)) / rate,
            u,
            model.simulate(u).y + noise.sequence(len(u), rng),
            rate,
            model.units,
        )
        for number, u in enumerate(commands, start=1)
    )
    known = KnownAxis(model, noise, records)
    return DrawnAxis(known, _facts(known) | facts)


def _facts(axis: KnownAxis) -> dict[str, Any]:
    model, noise = axis.model, axis.noise
    commands = np.concatenate([record.u for record in axis.records])
    kind = f"AR({len(noise.partial)})" if noise.partial else "white"
    return {
        "rate_hz": model.sample_rate_hz,
        "true_order": len(model.linear.poles),
        "true_modes": len(model.dominant_modes),
        "true_delay_samples": model.linear.total_delay,
        "true_delay_s": model.linear.delay_samples / model.sample_rate_hz,
        "samples": len(commands),
        "noise": kind if noise.degrees_of_freedom is None else f"{kind}, Student t",
        "below_limit": float(np.mean(commands < model.saturation.lower)),
        "above_limit": float(np.mean(commands > model.saturation.upper)),
    }


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """Between two positive numbers, uniform in the logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _linear_block(
    rng: np.random.Generator, rate: float, record_s: float
) -> tuple[LinearBlock, tuple[Mode, ...]]:
    """An integrator times factors of unit steady gain: resonances with a zero pair beside them, damped pairs,
    lags with or without a zero, and a fraction of a sample of delay."""
    order = int(rng.integers(ORDERS[0], ORDERS[1] + 1))
    count = int(rng.integers(0, min(MOST_MODES, (order - 1) // 2) + 1))
    band = (max(0.3, 10 / record_s), min(0.35 * rate, HIGHEST_MODE_HZ))
    modes = _modes(rng, count, band, FORGETTING * record_s)
    poles, zeros = [np.array([1.0 + 0j])], [np.zeros(0, dtype=np.complex128)]
    for mode in modes:
        aside = float(np.exp(rng.uniform(0.08, 0.4) * rng.choice([-1, 1])))
        zero = Mode(
            min(mode.frequency_hz * aside, 0.45 * rate), mode.damping_ratio * log_uniform(rng, 0.5, 2)
        )
        poles.append(_pair(mode, rate))
        zeros.append(_pair(zero, rate))
    left = order - 1 - 2 * len(modes)
    if left > 0 and rng.random() < 0.3:
        part = float(rng.uniform(0.1, 0.45))
        poles.append(np.array([0j]))
        zeros.append(np.array([complex(-part / (1 - part))]))
        left -= 1
    while left > 0:
        if left > 1 and rng.random() < 0.35:
            pair = Mode(log_uniform(rng, max(0.2, 3 / record_s), 0.3 * rate), float(rng.uniform(0.35, 0.9)))
            near = Mode(pair.frequency_hz * log_uniform(rng, 0.7, 1.4), float(rng.uniform(0.35, 0.9)))
            poles.append(_pair(pair, rate))
            zeros.append(_pair(near, rate))
            left -= 2
            continue
        left -= 1
        if rng.random() < 0.75:
            time_constant = log_uniform(rng, 0.7 / rate, 0.05 * record_s)
            near_s = time_constant * float(np.exp(rng.uniform(0.05, 0.5) * rng.choice([-1, 1])))
            zeros.append(np.array([complex(np.exp(-1 / (rate * near_s)))]))
        else:
            time_constant = log_uniform(rng, 0.5 / rate, max(0.1, 2 / rate))
        poles.append(np.array([complex(np.exp(-1 / (rate * time_constant)))]))
    all_poles, all_zeros = np.concatenate(poles), np.concatenate(zeros)
    steady = np.prod(1 - all_zeros).real / np.prod(1 - all_poles[1:]).real
    gain = log_uniform(rng, 0.1, 3.0) / rate / steady
    longest = min(LONGEST_DELAY_S, LONGEST_DELAY_SHARE * record_s)
    delay = 0 if rng.random() < 0.2 else round(float(rng.uniform(0, longest)) * rate)
    return LinearBlock(all_zeros, all_poles, float(gain), delay), modes


def _modes(
    rng: np.random.Generator, count: int, band_hz: tuple[float, float], longest_decay_s: float
) -> tuple[Mode, ...]:
    """Light modes at least 30 % apart; fewer than `count` where the band has no room."""
    frequencies: list[float] = []
    for _ in range(50):
        candidate = log_uniform(rng, *band_hz)
        if len(frequencies) < count and all(abs(np.log(candidate / f)) > 0.26 for f in frequencies):
            frequencies.append(candidate)
    least = [max(DAMPING[0], 1 / (2 * np.pi * f * longest_decay_s)) for f in sorted(frequencies)]
    return tuple(
        Mode(f, log_uniform(rng, low, max(DAMPING[1], 1.5 * low)))
        for f, low in zip(sorted(frequencies), least, strict=True)
    )


def _pair(mode: Mode, rate: float) -> ComplexArray:
    pole = mode.pole(rate)
    return np.array([pole, pole.conjugate()])


def _commands(
    rng: np.random.Generator, rate: float, samples: int, modes: tuple[Mode, ...]
) -> tuple[str, list[FloatArray]]:
    """RECORDS commands of one kind: sweeps over the modes, slews, or what an axis does in operation."""
    kinds: Mapping[str, Callable[[], FloatArray]] = {
        "sweep": lambda: _sweep(rng, rate, samples, modes),
        "slews": lambda: FAMILIES[SLEWS[0]](rng, rate, samples),
        "operation": lambda: FAMILIES[str(rng.choice(OPERATION))](rng, rate, samples),
    }
    kind = str(rng.choice(list(kinds), p=[0.4, 0.25, 0.35]))
    return kind, [kinds[kind]() for _ in range(RECORDS)]


def _sweep(rng: np.random.Generator, rate: float, samples: int, modes: tuple[Mode, ...]) -> FloatArray:
    highest = max((mode.frequency_hz for mode in modes), default=2.0)
    stop = min(0.45 * rate, max(2.0, highest * float(rng.uniform(1.1, 1.6))))
    phase = -np.pi / 4 * float(rng.uniform(0.8, 1.2))
    return sine_sweep(rate, samples / rate, 1.0, 0.0, stop, start_phase_rad=phase)[:samples]


def _saturation(rng: np.random.Generator, commands: FloatArray) -> Saturation | None:
    """Limits that a share of the commands in CLIPPED exceeds, or None where either side has none."""
    low = float(np.quantile(commands, log_uniform(rng, *CLIPPED))) * float(rng.uniform(0.85, 0.98))
    high = float(np.quantile(commands, 1 - log_uniform(rng, *CLIPPED))) * float(rng.uniform(0.85, 0.98))
    return Saturation(low, high) if low < -0.05 and high > 0.05 else None


def _both_met(saturation: Saturation, commands: FloatArray) -> bool:
    """Whether at least LEAST_CLIPPED of the commands lie beyond either limit."""
    beyond = np.mean(commands < saturation.lower), np.mean(commands > saturation.upper)
    return bool(min(beyond) >= LEAST_CLIPPED)


def _noise(rng: np.random.Generator, sigma: float) -> TrueNoise:
    kind = str(rng.choice(["white", "coloured", "heavy"]))
    if kind == "white":
        return TrueNoise(sigma)
    partial = (float(rng.uniform(0.2, 0.85)), float(rng.uniform(-0.4, 0.4)))[: int(rng.integers(1, 3))]
    if kind == "coloured":
        return TrueNoise(sigma, partial)
    return TrueNoise(sigma, partial if rng.random() < 0.5 else (), float(rng.uniform(3.0, 8.0)))


def _rounding_box_member(rng: np.random.Generator) -> LinearBlock:
    """A stable member with an exact integrator, velocity gain within 30 % of the representative's."""
    box, wanted = nanshan_rounding_box(), nanshan_model().linear.velocity_gain(SAMPLE_RATE_HZ)
    while True:
        numerators, denominators = box.sample_integrators(rng, 2000)
        reduced = without_integrator(denominators)
        stable = np.all(np.abs(roots_of_rows(reduced)) < 0.998, axis=1)
        gain = SAMPLE_RATE_HZ * numerators.sum(axis=1) / reduced.sum(axis=1)
        kept = np.flatnonzero(stable & (np.abs(gain / wanted - 1) < 0.3))
        if len(kept):
            one = int(kept[0])
            poles = np.concatenate([[1.0], roots_of_rows(reduced[one : one + 1])[0]])
            lead = int(np.flatnonzero(box.numerator)[0])
            zeros = np.roots(numerators[one, lead:])
            return LinearBlock(zeros, poles, float(numerators[one, lead]), lead + len(zeros) - len(poles))
