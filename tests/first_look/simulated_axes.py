"""Axes with known answers, and their records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from printed.nanshan import nanshan_model
from twin import coloured_noise

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.frequency_response import FrequencyResponse
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record, Units

GAIN = 0.25


def linear_twin() -> HammersteinWiener:
    """The Nanshan twin without limits and dead zone."""
    return replace(nanshan_model(0.0), saturation=Saturation(-1e3, 1e3))


def three_twins() -> dict[str, HammersteinWiener]:
    """Axes without limits and dead zone: the Nanshan twin, a slow one at 10 Hz, a stiff one at 200 Hz."""
    return {
        "nanshan": linear_twin(),
        "slow": _axis("slow", 10.0, [Mode(0.9, 0.08)], 0.7, 2),
        "stiff": _axis("stiff", 200.0, [Mode(11.0, 0.02), Mode(34.0, 0.03)], 0.97, 5),
    }


def _axis(
    name: str, sample_rate_hz: float, modes: Sequence[Mode], lag: float, delay_samples: int
) -> HammersteinWiener:
    """An integrator, a lag and modes; the speed is the command's in the long run."""
    poles = [p for mode in modes for p in (mode.pole(sample_rate_hz), mode.pole(sample_rate_hz).conjugate())]
    zeros = [0.98 * p**1.3 for p in poles]
    at_one = np.prod(1 - np.array(zeros)) / np.prod(1 - np.array([lag, *poles]))
    linear = LinearBlock(
        np.array(zeros),
        np.array([1.0, lag, *poles]),
        float(1 / (sample_rate_hz * at_one.real)),
        delay_samples,
    )
    return HammersteinWiener(
        name, sample_rate_hz, Saturation(-1e3, 1e3), linear, DeadZone(0.0), tuple(modes), noise_sigma=1e-4
    )


def measured(
    model: HammersteinWiener, u: FloatArray, sigma: float, rng: np.random.Generator, name: str = "run"
) -> Record:
    """The axis driven by u, with AR(1) noise."""
    y = model.simulate(u).y + coloured_noise(rng, len(u), sigma, 0.6)
    return Record(name, np.arange(len(u)) / model.sample_rate_hz, u, y, model.sample_rate_hz, model.units)


def delayed_integrator(
    u: FloatArray, sample_rate_hz: float, delay_samples: int, sigma: float, rng: np.random.Generator
) -> Record:
    """y = GAIN times the integral of u, `delay_samples` late, with white noise."""
    y = GAIN / sample_rate_hz * np.cumsum(np.concatenate([np.zeros(delay_samples), u])[: len(u)])
    t = np.arange(len(u)) / sample_rate_hz
    return Record("integrator", t, u, y + sigma * rng.standard_normal(len(u)), sample_rate_hz, Units())


def covered(response: FrequencyResponse, model: HammersteinWiener) -> list[bool]:
    """Whether |G| lies in the band, at every frequency with a coherence above 0.8."""
    truth = np.abs(model.linear.frequency_response(response.frequency_hz, model.sample_rate_hz))
    inside = (response.lower <= truth) & (truth <= response.upper)
    return inside[response.coherence > 0.8].tolist()


def share(answers: Sequence[bool]) -> float:
    return float(np.mean(answers))
