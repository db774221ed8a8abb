"""Velocity commands that excite an axis for identification.

Every function returns samples at k / sample_rate_hz, k = 0, 1, ..., as an array of shape (samples,) with
samples = round(duration_s sample_rate_hz), in the unit of its amplitude, and raises InputError for arguments
that make no such signal.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import optimize

from bayes_hw.arrays import FloatArray
from bayes_hw.errors import InputError
from bayes_hw.model.blocks import Saturation


def sine_sweep(
    sample_rate_hz: float,
    duration_s: float,
    amplitude: float,
    start_hz: float = 0.0,
    stop_hz: float = 5.0,
    *,
    start_phase_rad: float = 0.0,
) -> FloatArray:
    """Linear sweep amplitude sin(2 pi (f0 t + (f1 - f0) t^2 / (2 T)) + start phase), T the duration.

    Its instantaneous frequency moves linearly from `start_hz` to `stop_hz`. 0 to 5 Hz at 20 Hz is the
    excitation of Acta Astronomica Sinica, doi 10.15940/j.cnki.0001-5245.2026.01.012, section 4.

    From 0 Hz an integrating axis comes to swing about a point away from its start, by a Fresnel integral
    proportional to sin(start phase + pi / 4). A start phase of -pi / 4 makes it swing about its start, across
    the dead zone; unequal limits add a drift, see `balancing_offset`.
    """
    t = _times(sample_rate_hz, duration_s)
    phase = _sweep_phase(t, sample_rate_hz, duration_s, start_hz, stop_hz)
    return amplitude * np.sin(phase + start_phase_rad)


def amplitude_modulated_sweep(
    sample_rate_hz: float,
    duration_s: float,
    amplitude: float,
    start_hz: float = 0.0,
    stop_hz: float = 5.0,
    *,
    modulation_hz: float,
    depth: float = 0.9,
    start_phase_rad: float = 0.0,
) -> FloatArray:
    """A linear sweep whose envelope is amplitude (1 - depth (1 - cos(2 pi fm t)) / 2).

    The envelope runs between `amplitude` and amplitude (1 - depth), 0 <= depth <= 1, so that large and small
    amplitudes meet in every band: the paper's proposal for showing the nonlinear blocks (section 4).
    """
    if not 0 <= depth <= 1:
        raise InputError(f"depth: must lie between 0 and 1, got {depth:g}")
    t = _times(sample_rate_hz, duration_s)
    envelope = 1 - depth * (1 - np.cos(2 * np.pi * modulation_hz * t)) / 2
    return envelope * sine_sweep(
        sample_rate_hz, duration_s, amplitude, start_hz, stop_hz, start_phase_rad=start_phase_rad
    )


def phase_modulated_sweep(
    sample_rate_hz: float,
    duration_s: float,
    amplitude: float,
    start_hz: float = 0.0,
    stop_hz: float = 5.0,
    *,
    modulation_hz: float,
    deviation_rad: float,
    start_phase_rad: float = 0.0,
) -> FloatArray:
    """A linear sweep with deviation_rad sin(2 pi fm t) added to its phase.

    The instantaneous frequency swings by deviation_rad fm around the sweep's, so the signal passes each band
    several times at constant amplitude: the paper's other proposal (section 4).
    """
    t = _times(sample_rate_hz, duration_s)
    phase = _sweep_phase(t, sample_rate_hz, duration_s, start_hz, stop_hz)
    phase += deviation_rad * np.sin(2 * np.pi * modulation_hz * t)
    return amplitude * np.sin(phase + start_phase_rad)


def random_phase_multisine(
    rng: np.random.Generator,
    sample_rate_hz: float,
    duration_s: float,
    rms: float,
    start_hz: float,
    stop_hz: float,
) -> FloatArray:
    """Sum of equal sines at every multiple of 1 / T in [start_hz, stop_hz], phases uniform, with root mean
    square `rms`; T = samples / sample_rate_hz, so one period fills the signal and its mean is zero.

    Pintelon and Schoukens, System Identification, 2nd ed. (doi 10.1002/9781118287422), section 2.4.
    """
    samples = len(_times(sample_rate_hz, duration_s))
    _check_band(sample_rate_hz, start_hz, stop_hz)
    frequency = np.fft.rfftfreq(samples, 1 / sample_rate_hz)
    lines = np.flatnonzero(
        (frequency >= start_hz) & (frequency <= stop_hz) & (frequency < sample_rate_hz / 2)
    )
    lines = lines[lines > 0]
    if lines.size == 0:
        raise InputError("multisine: no multiple of 1 / duration lies in the band; take it longer")
    spectrum = np.zeros(len(frequency), dtype=np.complex128)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(len(lines)))
    return np.asarray(
        rms * samples / np.sqrt(2 * len(lines)) * np.fft.irfft(spectrum, samples), dtype=np.float64
    )


def staircase(sample_rate_hz: float, hold_s: float, levels: Sequence[float], repeats: int = 1) -> FloatArray:
    """Each level held for `hold_s`, first as given and then with opposite sign, `repeats` times over.

    Every second half mirrors the first, so the axis reverses and returns: slow reversals show the dead zone,
    the levels show the saturation. The signal has 2 repeats len(levels) steps.
    """
    hold = len(_times(sample_rate_hz, hold_s))
    steps = np.asarray(levels, dtype=np.float64)
    if steps.size == 0 or repeats < 1:
        raise InputError("staircase: needs at least one level and one repeat")
    return np.repeat(np.tile(np.concatenate([steps, -steps]), repeats), hold)


def balancing_offset(u: FloatArray, saturation: Saturation) -> float:
    """The constant b for which the mean of saturation(u + b) is zero.

    Unequal limits turn a symmetric command that reaches them into a steady drift of an integrating axis;
    u + b leaves it where it started. Where u never reaches a limit, b is minus its mean; where it is always
    at one, a range of constants would do and one of them is returned.
    """
    u = np.asarray(u, dtype=np.float64)
    largest = float(np.abs(u).max()) + max(-saturation.lower, saturation.upper) / saturation.gain
    return float(optimize.brentq(lambda b: saturation(u + b).mean(), -largest, largest, xtol=1e-14))


def _times(sample_rate_hz: float, duration_s: float) -> FloatArray:
    if not (np.isfinite(sample_rate_hz) and sample_rate_hz > 0):
        raise InputError(f"sample_rate_hz: must be finite and positive, got {sample_rate_hz:g}")
    samples = round(duration_s * sample_rate_hz) if np.isfinite(duration_s) else 0
    if samples < 1:
        raise InputError(f"duration: {duration_s:g} s holds no sample at {sample_rate_hz:g} Hz")
    return np.arange(samples) / sample_rate_hz


def _check_band(sample_rate_hz: float, start_hz: float, stop_hz: float) -> None:
    if not (0 <= start_hz <= sample_rate_hz / 2 and 0 <= stop_hz <= sample_rate_hz / 2):
        raise InputError(f"band {start_hz:g} to {stop_hz:g} Hz: must lie between 0 and half the sample rate")


def _sweep_phase(
    t: FloatArray, sample_rate_hz: float, duration_s: float, start_hz: float, stop_hz: float
) -> FloatArray:
    _check_band(sample_rate_hz, start_hz, stop_hz)
    slope = (stop_hz - start_hz) / duration_s
    return 2 * np.pi * (start_hz * t + slope * t**2 / 2)
