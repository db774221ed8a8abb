"""Axes and records whose posteriors are not the twin's: a sampler good there need not be good here."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from twin import coloured_noise

from bayes_hw.arrays import FloatArray
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record

SAMPLE_RATE_HZ = 20.0
NOISE_SIGMA = 0.01
NOISE_CORRELATION = 0.5
HOLD_SAMPLES = 8
HARD_AXES_SEED = 1
"""Seed of the noise for which the dead zone of the last case has two modes of like weight."""

HARD_AXES = (
    "saturation hardly reached",
    "dead zone hardly visited",
    "two modes close together",
    "bimodal dead zone",
)


@dataclass(frozen=True, eq=False)
class HardAxis:
    """A model and one record of it, simulated with the model's own parameters but for what `name` says."""

    name: str
    model: HammersteinWiener
    record: Record


def hard_axis(name: str, rng: np.random.Generator, samples: int = 1200) -> HardAxis:
    """One of HARD_AXES.

    The limits are -0.8 and 1 and the commands steps of random height, held for 0.4 s. In the first case they
    exceed the upper limit in one step by a fifth and never reach the lower one; in the second a constant
    command carries the output away from zero for good; in the third the modes are 3 Hz and 3.15 Hz. The
    fourth has no integrator and no mode: see `_two_dead_zones`.
    """
    if name == "bimodal dead zone":
        return _two_dead_zones(rng)
    held = rng.normal(0.0, 0.8, size=-(-samples // HOLD_SAMPLES))
    second = 3.15 if name == "two modes close together" else 5.0
    model = _axis((Mode(3.0, 0.06), Mode(second, 0.06)))
    if name == "saturation hardly reached":
        held = np.clip(held, -0.7, 0.9)
        held[len(held) // 2] = 1.2
    if name == "dead zone hardly visited":
        held = np.clip(held, -0.7, 0.9) + 0.25
        held[:3] = 0.9
    u = np.repeat(held, HOLD_SAMPLES)[:samples]
    return HardAxis(name, model, _record(name, model, u, model.simulate(u).y, rng))


def _axis(modes: tuple[Mode, ...]) -> HammersteinWiener:
    pairs = [mode.pole(SAMPLE_RATE_HZ) for mode in modes]
    linear = LinearBlock(
        zeros=np.array([0.3, 0.7 + 0.6j, 0.7 - 0.6j]),
        poles=np.array([1.0, *pairs, *np.conj(pairs)]),
        gain=0.02,
        delay_samples=1,
    )
    return HammersteinWiener(
        "hard axis",
        SAMPLE_RATE_HZ,
        Saturation(-0.8, 1.0),
        linear,
        DeadZone(0.02),
        dominant_modes=modes,
        noise_sigma=NOISE_SIGMA,
    )


def _two_dead_zones(rng: np.random.Generator) -> HardAxis:
    """A lag of unit gain whose record was written with two dead zones: two values explain it equally well.

    Square waves of three amplitudes; w hardly leaves the dead zone in the smallest one. Beyond that amplitude
    a wider dead zone costs nothing more there, so that the two halves of the record keep a mode each instead
    of agreeing on a mean.
    """
    linear = LinearBlock(np.zeros(0, complex), np.array([0.5 + 0j]), 0.5, 1)
    model = HammersteinWiener(
        "lag", SAMPLE_RATE_HZ, Saturation(-2.0, 2.0), linear, DeadZone(0.095), noise_sigma=NOISE_SIGMA
    )
    small = _square_wave(0.11, 10)
    large = np.concatenate([_square_wave(0.35, 1), _square_wave(1.0, 1)])
    y = np.concatenate([model.simulate(small).y, with_half_width(model, 0.142).simulate(large).y])
    u = np.concatenate([small, large])
    return HardAxis("bimodal dead zone", model, _record("bimodal dead zone", model, u, y, rng))


def _square_wave(amplitude: float, periods: int) -> FloatArray:
    return np.tile(np.repeat([amplitude, -amplitude], 10), periods)


def _record(
    name: str, model: HammersteinWiener, u: FloatArray, y: FloatArray, rng: np.random.Generator
) -> Record:
    noise = coloured_noise(rng, len(u), NOISE_SIGMA, NOISE_CORRELATION)
    t = np.arange(len(u)) / SAMPLE_RATE_HZ
    return Record(name, t, u, y + noise, SAMPLE_RATE_HZ, model.units)


def with_half_width(model: HammersteinWiener, half_width: float) -> HammersteinWiener:
    """The model with another dead zone."""
    return replace(model, dead_zone=replace(model.dead_zone, half_width=half_width))
