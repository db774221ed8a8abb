"""Velocity commands that an axis is given, as shares of the larger limit; shape (samples,) each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.effects.effect import log_uniform

HIGHEST_HZ = 5.0
SWEEP_PEAK = 1.65
STEP_PEAK = 1.3
NOISE_RMS = 0.45

Excitation: TypeAlias = Callable[[np.random.Generator, float, int], FloatArray]


def modulated_sweep(rng: np.random.Generator, rate: float, samples: int) -> FloatArray:  # noqa: ARG001
    """0 to 5 Hz with an envelope that swells every 20 to 30 s, past both limits at its crests."""
    t = _time(rate, samples)
    stop = min(HIGHEST_HZ, 0.4 * rate)
    swells = max(2, round(t[-1] / 24))
    envelope = 1 - 0.45 * (1 + np.cos(2 * np.pi * swells * t / (samples / rate)))
    return SWEEP_PEAK * envelope * np.sin(np.pi * stop * t**2 * rate / samples)


def plain_sweep(rng: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """A linear sweep of constant amplitude, up or down, that lets the axis swing about zero."""
    t = _time(rate, samples)
    stop = min(float(rng.uniform(2, 6)), 0.4 * rate)
    start = float(rng.uniform(0.0, 0.2))
    phase = 2 * np.pi * (start * t + 0.5 * (stop - start) * t**2 * rate / samples)
    sweep = float(rng.uniform(0.6, 1.5)) * np.sin(phase - np.pi / 4)
    return sweep[::-1].copy() if rng.random() < 0.3 else sweep


def steps_and_triangles(rng: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """Held levels of either sign and bursts of triangles, of 0.5 to 10 s each, as in a commissioning run."""
    levels = np.concatenate([[0.0], STEP_PEAK * np.array([0.05, 0.15, 0.4, 0.8, 1.0])])
    out = np.empty(0)
    while len(out) < samples:
        level = float(rng.choice(levels[1:])) * float(rng.choice([-1.0, 1.0]))
        length = max(2, round(log_uniform(rng, 0.7, 10.0) * rate))
        if rng.random() < 0.35:
            cycles = int(rng.integers(1, 4))
            ramp = np.arange(length) / length * cycles
            out = np.concatenate([out, level * (2 * np.abs(2 * (ramp % 1.0) - 1) - 1)])
        else:
            held = float(rng.choice([0.0, level, level, level]))
            out = np.concatenate([out, np.full(length, held)])
    return out[:samples]


def pink_multisine(rng: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """Random phases up to 5 Hz with power falling as 1 / f."""
    return NOISE_RMS * _multisine(rng, rate, samples, min(HIGHEST_HZ, 0.4 * rate), 0.5)


def flat_multisine(rng: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """Random phases, equal lines, in a band of its own and at a level of its own."""
    highest = min(float(rng.uniform(1, 8)), 0.4 * rate)
    return float(rng.uniform(0.2, 0.8)) * _multisine(rng, rate, samples, highest, 0.0)


def telegraph(rng: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """Two levels that change at random instants, 0.3 to 4 s apart."""
    out = np.empty(0)
    level, sign = float(rng.uniform(0.3, 1.3)), 1.0
    while len(out) < samples:
        out = np.concatenate([out, np.full(max(1, round(log_uniform(rng, 0.3, 4.0) * rate)), sign * level)])
        sign = -sign
    return out[:samples]


def raster_scan(rng: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """Scans at constant speed with smooth turns, as in mapping a source, on slow sidereal tracking."""
    t = _time(rate, samples)
    period, turn = float(rng.uniform(8, 40)), float(rng.uniform(0.05, 0.25))
    scan = np.clip(np.sin(2 * np.pi * t / period) / np.sin(np.pi * turn / 2), -1, 1)
    return float(rng.uniform(0.2, 0.9)) * scan + float(rng.uniform(-0.02, 0.02))


def slews_and_tracking(rng: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """Slews at or beyond the limit between stretches of slow tracking."""
    out = np.empty(0)
    sign = float(rng.choice([-1.0, 1.0]))
    while len(out) < samples:
        track = max(2, round(float(rng.uniform(2, 12)) * rate))
        slew = max(2, round(float(rng.uniform(1, 6)) * rate))
        ramp = np.clip(np.minimum(np.arange(slew), np.arange(slew)[::-1]) / (0.15 * slew), 0, 1)
        out = np.concatenate(
            [out, np.full(track, float(rng.uniform(-0.08, 0.08))), sign * float(rng.uniform(0.5, 1.4)) * ramp]
        )
        sign = -sign
    return out[:samples]


def acceptance_run(rng: np.random.Generator, rate: float, samples: int) -> FloatArray:
    """A square wave for 30 s, a slow sine for 30 s (at most half the record each), then a multisine."""
    part = round(min(30.0, samples / rate / 2) * rate)
    t = _time(rate, samples)
    square = 0.35 * np.sign(np.sin(2 * np.pi * t[:part] / 7.0))
    slow = 0.9 * np.sin(2 * np.pi * t[:part] / 11.0)
    rest = max(samples - 2 * part, 0)
    noise = _multisine(rng, rate, rest, min(3.0, 0.4 * rate), 0.5) if rest > rate else np.zeros(rest)
    return np.concatenate([square, slow, NOISE_RMS * noise])[:samples]


FAMILIES: Mapping[str, Excitation] = {
    function.__name__: function
    for function in (
        modulated_sweep,
        plain_sweep,
        steps_and_triangles,
        pink_multisine,
        flat_multisine,
        telegraph,
        raster_scan,
        slews_and_tracking,
        acceptance_run,
    )
}


def _multisine(
    rng: np.random.Generator, rate: float, samples: int, highest_hz: float, power: float
) -> FloatArray:
    """Lines at the multiples of 1 / T up to `highest_hz`, amplitude ~ f^-power, rms 1."""
    frequency = np.fft.rfftfreq(samples, 1 / rate)
    lines = (frequency > 0) & (frequency <= highest_hz)
    amplitude = np.where(lines, np.where(frequency > 0, frequency, 1.0) ** -power, 0.0)
    wave = np.fft.irfft(amplitude * np.exp(2j * np.pi * rng.random(len(frequency))), samples)
    return np.asarray(wave / np.std(wave), dtype=np.float64)


def _time(rate: float, samples: int) -> FloatArray:
    return np.arange(samples) / rate
