"""Fixtures of several test modules: one BLAS thread, and a small axis with records simulated from it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.model.blocks import DeadZone, Saturation
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.linear import LinearBlock, Mode
from bayes_hw.record import Record, Units
from bayes_hw.threads import one_blas_thread

SAMPLE_RATE_HZ = 20.0


@pytest.fixture(autouse=True, scope="session")
def _one_blas_thread() -> Iterator[None]:
    with one_blas_thread():
        yield


@pytest.fixture(scope="session")
def small_axis() -> HammersteinWiener:
    """An integrator and one mode of 2 Hz at 20 Hz: six parameters without the noise."""
    mode = Mode(2.0, 0.1)
    pole = mode.pole(SAMPLE_RATE_HZ)
    linear = LinearBlock(
        np.array([0.3 + 0j]), np.array([1.0, pole, pole.conjugate()]), gain=0.02, delay_samples=1
    )
    return HammersteinWiener(
        name="small axis",
        sample_rate_hz=SAMPLE_RATE_HZ,
        saturation=Saturation(-0.8, 1.0),
        linear=linear,
        dead_zone=DeadZone(0.02),
        dominant_modes=(mode,),
        noise_sigma=0.01,
    )


def command(samples: int, rng: np.random.Generator) -> FloatArray:
    """Steps of random height held for 0.4 s: they saturate the axis and cross its dead zone."""
    held = rng.normal(0, 0.9, size=-(-samples // 8))
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
) -> Record:
    """A record of `model` with AR(1) noise of its own sigma."""
    rng = np.random.default_rng(seed)
    u = command(samples, rng)
    y = model.simulate(u, initial_position).y + coloured_noise(samples, model.noise_sigma, correlation, rng)
    t = np.arange(samples) / model.sample_rate_hz
    return Record(f"simulated_{seed}", t, u, y, model.sample_rate_hz, Units())


@pytest.fixture(scope="session")
def small_record(small_axis: HammersteinWiener) -> Record:
    """800 samples of the small axis with AR(1) noise, sigma 0.01, correlation 0.5."""
    return measured(small_axis, 800, seed=1)
