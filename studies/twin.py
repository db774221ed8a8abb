"""The twin of the Nanshan 26 m azimuth axis: records simulated as the paper's experiment was run.

The position loop is open; a 0 to 5 Hz sine sweep of velocity is the command and the encoder's angle the
output, at 20 Hz (Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012, section 3.2). What the
paper does not print is chosen here and stated: see `twin_records`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from printed.nanshan import SAMPLE_RATE_HZ, nanshan_model
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.model.excitation import balancing_offset, sine_sweep
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

DURATION_S = 120.0
STOP_HZ = 5.0
AMPLITUDE = 0.5
DEAD_ZONE_HALF_WIDTH = 0.006
NOISE_SHARE = 0.054
NOISE_CORRELATION = 0.6
START_PHASES_RAD = tuple(share * np.pi for share in (-0.25, -0.20, -0.30, -0.22, -0.27))
OFFSET_SHARES = (0.4, 1.6, 0.4, 1.6, 0.4)
TRAIN_RECORDS = 3


@dataclass(frozen=True, eq=False)
class TwinExperiment:
    """Training and validation records of the twin, and the model that they were simulated from."""

    train: tuple[Record, ...]
    validation: tuple[Record, ...]
    truth: HammersteinWiener


def twin_records(
    rng: np.random.Generator,
    *,
    amplitude: float = AMPLITUDE,
    dead_zone_half_width: float = DEAD_ZONE_HALF_WIDTH,
    noise_share: float = NOISE_SHARE,
    noise_correlation: float = NOISE_CORRELATION,
    duration_s: float = DURATION_S,
) -> TwinExperiment:
    """Three training and two validation records of `duration_s`, each with noise of its own.

    Every command is a sweep from 0 to 5 Hz of `amplitude`, by default 0.5 and so beyond both limits,
    with a start phase near -pi / 4, so that the axis swings about its start, plus a constant. Unequal
    limits turn such a sweep into a drift; OFFSET_SHARES of the constant that would cancel it send the
    records to either side of zero in turn, through the dead zone. The noise is AR(1) with marginal standard
    deviation `noise_share` of the mean spread of the validation outputs, so that the true model fits them
    to about 94.6 %, the paper's value for its Hammerstein-Wiener model. Amplitude, offsets and dead zone
    were chosen from a coarse scan so that a linear model then fits them to about the paper's 86.2 %; the
    paper prints none of the three.
    """
    model = nanshan_model(dead_zone_half_width)
    commands = [
        _command(model, amplitude, duration_s, phase, share)
        for phase, share in zip(START_PHASES_RAD, OFFSET_SHARES, strict=True)
    ]
    clean = [model.simulate(u).y for u in commands]
    sigma = noise_share * float(np.mean([np.std(y) for y in clean[TRAIN_RECORDS:]]))
    names = ("train_1", "train_2", "train_3", "validation_1", "validation_2")
    records = tuple(
        Record(
            name,
            np.arange(len(u)) / SAMPLE_RATE_HZ,
            u,
            y + coloured_noise(rng, len(y), sigma, noise_correlation),
            SAMPLE_RATE_HZ,
            model.units,
            source="simulated, twin of the Nanshan 26 m azimuth axis",
        )
        for name, u, y in zip(names, commands, clean, strict=True)
    )
    truth = nanshan_model(dead_zone_half_width, sigma)
    return TwinExperiment(records[:TRAIN_RECORDS], records[TRAIN_RECORDS:], truth)


def coloured_noise(rng: np.random.Generator, samples: int, sigma: float, correlation: float) -> FloatArray:
    """A stationary AR(1) sequence of marginal standard deviation `sigma`, e(k) = correlation e(k-1) +
    a(k)."""
    white = rng.standard_normal(samples) * np.sqrt(1 - correlation**2)
    white[0] /= np.sqrt(1 - correlation**2)
    return sigma * np.asarray(signal.lfilter([1.0], [1.0, -correlation], white), dtype=np.float64)


def _command(
    model: HammersteinWiener, amplitude: float, duration_s: float, phase_rad: float, share: float
) -> FloatArray:
    sweep = sine_sweep(SAMPLE_RATE_HZ, duration_s, amplitude, 0.0, STOP_HZ, start_phase_rad=phase_rad)
    return sweep + share * balancing_offset(sweep, model.saturation)
