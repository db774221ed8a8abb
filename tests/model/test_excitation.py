"""The excitations have the frequencies, amplitudes and balance that their docstrings promise."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.model.blocks import Saturation
from bayes_hw.model.excitation import (
    amplitude_modulated_sweep,
    balancing_offset,
    phase_modulated_sweep,
    random_phase_multisine,
    sine_sweep,
    staircase,
)

RATE_HZ = 20.0


def _local_frequency(signal: FloatArray, start: int, stop: int, rate_hz: float) -> float:
    """Frequency of the highest line of a windowed piece, by a zero-padded transform."""
    piece = signal[start:stop] * np.hanning(stop - start)
    spectrum = np.abs(np.fft.rfft(piece, 1 << 16))
    return float(np.argmax(spectrum) * rate_hz / (1 << 16))


@pytest.mark.parametrize(("start_hz", "stop_hz"), [(0.0, 5.0), (5.0, 1.0)])
def test_sweep_frequency_moves_linearly(start_hz: float, stop_hz: float) -> None:
    duration = 2000.0
    u = sine_sweep(RATE_HZ, duration, 0.5, start_hz, stop_hz)
    assert len(u) == 40_000
    for middle in (10_000, 20_000, 30_000):
        expected = start_hz + (stop_hz - start_hz) * middle / len(u)
        found = _local_frequency(u, middle - 500, middle + 500, RATE_HZ)
        assert found == pytest.approx(expected, abs=0.02)


def test_sweep_reaches_its_amplitude_and_starts_at_its_phase() -> None:
    u = sine_sweep(RATE_HZ, 600, 0.7, start_phase_rad=-np.pi / 4)
    assert u[0] == pytest.approx(-0.7 * np.sin(np.pi / 4))
    assert np.abs(u).max() == pytest.approx(0.7, rel=1e-3)
    assert np.abs(u).max() <= 0.7


def test_phase_minus_45_degrees_centres_an_integrating_axis() -> None:
    """The summed sweep ends near its start, while from phase 0 it ends off it by the Fresnel integral."""
    duration, stop_hz = 600.0, 5.0
    fresnel_limit = np.sqrt(duration / stop_hz) / (2 * np.sqrt(2))
    for phase, expected in ((0.0, fresnel_limit), (-np.pi / 4, 0.0)):
        u = sine_sweep(RATE_HZ, duration, 1.0, 0.0, stop_hz, start_phase_rad=phase)
        assert u.sum() / RATE_HZ == pytest.approx(expected, abs=0.07)


def test_amplitude_modulation_bounds_the_sweep() -> None:
    plain = sine_sweep(RATE_HZ, 200, 0.5)
    u = amplitude_modulated_sweep(RATE_HZ, 200, 0.5, modulation_hz=0.05, depth=0.8)
    loud, quiet = np.arange(0, 4000, 400), np.arange(200, 4000, 400)
    assert u[loud] == pytest.approx(plain[loud], abs=1e-12)
    assert u[quiet] == pytest.approx(0.2 * plain[quiet], abs=1e-12)
    assert np.all(np.abs(u) <= np.abs(plain) + 1e-15)


def test_phase_modulation_swings_the_frequency() -> None:
    """On a constant carrier of 2 Hz the frequency runs between 2 +- deviation_rad modulation_hz."""
    u = phase_modulated_sweep(200, 400, 1.0, 2.0, 2.0, modulation_hz=0.01, deviation_rad=50.0)
    assert _local_frequency(u, 0, 800, 200) == pytest.approx(2.5, abs=0.05)
    assert _local_frequency(u, 9600, 10_400, 200) == pytest.approx(1.5, abs=0.05)


def test_multisine_has_its_band_its_rms_and_no_mean() -> None:
    u = random_phase_multisine(np.random.default_rng(0), RATE_HZ, 100, 0.3, 0.5, 4.0)
    power = np.abs(np.fft.rfft(u)) ** 2
    frequency = np.fft.rfftfreq(len(u), 1 / RATE_HZ)
    inside = (frequency >= 0.5) & (frequency <= 4.0)
    assert np.sqrt(np.mean(u**2)) == pytest.approx(0.3, rel=1e-12)
    assert power[~inside].max() < 1e-20 * power[inside].min()
    assert power[inside] == pytest.approx(power[inside][0] * np.ones(inside.sum()), rel=1e-9)


def test_multisine_phases_come_from_the_generator() -> None:
    first, again, other = (
        random_phase_multisine(np.random.default_rng(seed), RATE_HZ, 50, 1.0, 0.1, 5.0) for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.allclose(first, other)


def test_staircase_reverses_and_balances() -> None:
    u = staircase(RATE_HZ, 2.0, [0.1, 0.4], repeats=3)
    assert len(u) == 3 * 4 * 40
    assert u[::40].tolist() == [0.1, 0.4, -0.1, -0.4] * 3
    assert u.sum() == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("amplitude", [0.2, 0.5, 3.0])
def test_balancing_offset_stops_the_drift(amplitude: float) -> None:
    saturation = Saturation(-0.335, 0.438, gain=1.3)
    u = sine_sweep(RATE_HZ, 300, amplitude)
    b = balancing_offset(u, saturation)
    assert abs(saturation(u + b).mean()) < 1e-10
    if amplitude > 0.335:
        assert abs(saturation(u).mean()) > 1e-3


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: sine_sweep(0.0, 10, 1.0), "sample_rate_hz"),
        (lambda: sine_sweep(RATE_HZ, 0.01, 1.0), "holds no sample"),
        (lambda: sine_sweep(RATE_HZ, float("nan"), 1.0), "holds no sample"),
        (lambda: sine_sweep(RATE_HZ, 10, 1.0, 0.0, 11.0), "half the sample rate"),
        (
            lambda: amplitude_modulated_sweep(RATE_HZ, 10, 1.0, modulation_hz=0.1, depth=1.1),
            "depth",
        ),
        (
            lambda: random_phase_multisine(np.random.default_rng(0), RATE_HZ, 1, 1.0, 0.1, 0.2),
            "lies in the band",
        ),
        (lambda: staircase(RATE_HZ, 1.0, []), "at least one level"),
    ],
)
def test_impossible_signals_are_refused(make: Callable[[], FloatArray], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
