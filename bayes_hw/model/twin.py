"""The twin of the Nanshan 26 m azimuth axis: records simulated as the paper's experiment was run.

The position loop is open; a 0 to 5 Hz sine sweep of velocity is the command and the encoder's angle the output, at
20 Hz (Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012, section 3.2). What the paper does not print is
chosen here and stated: see `twin_records`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.model.excitation import balancing_offset, sine_sweep
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.nanshan import SAMPLE_RATE_HZ, nanshan_model
from bayes_hw.record import Record

DURATION_S = 120.0
STOP_HZ = 5.0
TRAIN_AMPLITUDES = (0.6, 0.5, 0.45)
VALIDATION_AMPLITUDES = (0.55, 0.5)
NOISE_SHARE = 0.054
NOISE_CORRELATION = 0.6
DEAD_ZONE_HALF_WIDTH = 0.003


@dataclass(frozen=True, eq=False)
class TwinExperiment:
    """Training and validation records of the twin, and the model that they were simulated from."""

    train: tuple[Record, ...]
    validation: tuple[Record, ...]
    truth: HammersteinWiener


def twin_records(
    rng: np.random.Generator,
    *,
    dead_zone_half_width: float = DEAD_ZONE_HALF_WIDTH,
    noise_share: float = NOISE_SHARE,
    noise_correlation: float = NOISE_CORRELATION,
    train_amplitudes: tuple[float, ...] = TRAIN_AMPLITUDES,
    validation_amplitudes: tuple[float, ...] = VALIDATION_AMPLITUDES,
    duration_s: float = DURATION_S,
) -> TwinExperiment:
    """Sweeps of different amplitude (units of u), each with noise of its own.

    """
    model = nanshan_model(dead_zone_half_width)
    commands = [
        _command(model, amplitude, number, duration_s)
        for number, amplitude in enumerate((*train_amplitudes, *validation_amplitudes))
    ]
    clean = [model.simulate(u).y for u in commands]
    validation = clean[len(train_amplitudes) :]
    sigma = noise_share * float(np.mean([np.std(y) for y in validation]))
    truth = nanshan_model(dead_zone_half_width, sigma)
    records = []
    for number, (u, y) in enumerate(zip(commands, clean, strict=True)):
        training = number < len(train_amplitudes)
        kind, index = ("train", number + 1) if training else ("validation", number + 1 - len(train_amplitudes))
        noisy = y + coloured_noise(rng, len(y), sigma, noise_correlation)
        t = np.arange(len(u)) / SAMPLE_RATE_HZ
        records.append(
            Record(f"{kind}_{index}", t, u, noisy, SAMPLE_RATE_HZ, model.units, source="the Nanshan twin")
        )
    count = len(train_amplitudes)
    return TwinExperiment(tuple(records[:count]), tuple(records[count:]), truth)


def coloured_noise(
    rng: np.random.Generator, samples: int, sigma: float, correlation: float
) -> FloatArray:
    """A stationary AR(1) sequence of marginal standard deviation `sigma`, e(k) = correlation e(k-1) + a(k)."""
    white = rng.standard_normal(samples) * np.sqrt(1 - correlation**2)
    white[0] /= np.sqrt(1 - correlation**2)
    return sigma * np.asarray(signal.lfilter([1.0], [1.0, -correlation], white), dtype=np.float64)


def _command(model: HammersteinWiener, amplitude: float, number: int, duration_s: float) -> FloatArray:
    phase = (-0.25 if number % 2 == 0 else 0.75) * np.pi
    sweep = sine_sweep(SAMPLE_RATE_HZ, duration_s, amplitude, 0.0, STOP_HZ, start_phase_rad=phase)
    return sweep + balancing_offset(sweep, model.saturation)
