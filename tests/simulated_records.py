"""Records simulated for the tests."""

from __future__ import annotations

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record, Units

SAMPLE_RATE_HZ = 20.0


def command(samples: int, rng: np.random.Generator) -> FloatArray:
    """Steps of random height held for 0.4 s: they saturate the axis and cross its dead zone."""
    held = rng.normal(0, 1.4, size=-(-samples // 8))
    return np.repeat(held, 8)[:samples]


def coloured_noise(samples: int, sigma: float, correlation: float, rng: np.random.Generator) -> FloatArray:
    """A stationary AR(1) sequence of marginal standard deviation `sigma`."""
    shocks = rng.standard_normal(samples) * sigma
    shocks[1:] *= np.sqrt(1 - correlation**2)
    return np.asarray(signal.lfilter([1.0], [1.0, -correlation], shocks))


def measured(
    model: HammersteinWiener,
    samples: int,
    seed: int,
    *,
    correlation: float = 0.5,
    initial_position: float = 0.0,
    rest: int = 0,
) -> Record:
    """A record of `model` with AR(1) noise of its own sigma, no command in its first `rest` samples."""
    rng = np.random.default_rng(seed)
    u = command(samples, rng)
    u[:rest] = 0.0
    y = model.simulate(u, initial_position).y + coloured_noise(samples, model.noise_sigma, correlation, rng)
    t = np.arange(samples) / model.sample_rate_hz
    return Record(f"simulated_{seed}", t, u, y, model.sample_rate_hz, Units())
