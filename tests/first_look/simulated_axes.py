"""Axes with known answers, and their records."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.frequency_response import FrequencyResponse
from bayes_hw.model.blocks import Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.nanshan import nanshan_model
from bayes_hw.model.twin import coloured_noise
from bayes_hw.record import Record, Units

GAIN = 0.25


def linear_twin() -> HammersteinWiener:
    """The Nanshan twin without limits and dead zone."""
    return replace(nanshan_model(0.0), saturation=Saturation(-1e3, 1e3))


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
