"""Stability margins and bandwidth of many loops at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bayes_hw.control.loop import Loop

REFINEMENTS = 6
"""Steps of regula falsi from a cell of the grid to a crossing: the error is far below a thousandth of it."""

HALF_POWER = np.sqrt(0.5)


@dataclass(frozen=True)
class Requirements:
    """Margins that a loop is to keep."""

    gain_margin_db: float = 6.0
    phase_margin_deg: float = 45.0
    delay_margin_s: float = 0.0

    def describe(self) -> str:
        """In words, with units."""
        parts = [
            f"gain margin of {self.gain_margin_db:g} dB",
            f"phase margin of {self.phase_margin_deg:g} deg",
        ]
        if self.delay_margin_s > 0:
            parts.append(f"delay margin of {self.delay_margin_s:g} s")
        return ", ".join(parts[:-1]) + " and " + parts[-1]


@dataclass(frozen=True, eq=False)
class Margins:
    """Margins of every draw, each of shape (draws,); NaN for a draw whose closed loop is unstable.

    `gain_margin_db` is the smallest factor on L, in dB, that makes the loop unstable; `gain_reduction_db` the
    smallest division that does, infinite where none does. `phase_margin_deg` is the smallest rotation of L in
    either direction; `delay_margin_s` the shortest additional delay. `modulus_margin` is the smallest
    |1 + L|, one over the peak of the sensitivity. `bandwidth_hz` is the lowest frequency at which |T|, T =
    L / (1 + L), falls below -3 dB; `crossover_hz` the lowest at which |L| falls below one;
    `phase_crossover_hz` where the gain margin is taken. `radius` is the largest modulus of the poles of the
    closed loop, known for unstable draws too.
    """

    radius: FloatArray
    gain_margin_db: FloatArray
    gain_reduction_db: FloatArray
    phase_margin_deg: FloatArray
    delay_margin_s: FloatArray
    modulus_margin: FloatArray
    bandwidth_hz: FloatArray
    crossover_hz: FloatArray
    phase_crossover_hz: FloatArray

    @property
    def stable(self) -> BoolArray:
        return np.asarray(self.radius < 1, dtype=np.bool_)

    def meets(self, requirements: Requirements) -> BoolArray:
        """Draws (draws,) that are stable and keep every margin asked for."""
        kept = (
            self.stable
            & (self.gain_margin_db >= requirements.gain_margin_db)
            & (self.gain_reduction_db >= requirements.gain_margin_db)
            & (self.phase_margin_deg >= requirements.phase_margin_deg)
            & (self.delay_margin_s >= requirements.delay_margin_s)
        )
        return np.asarray(kept, dtype=np.bool_)


@dataclass(frozen=True, eq=False)
class Crossings:
    """Points where a curve of some draws crosses a line: draw, frequency in Hz, and L there, (points,)."""

    draw: IntArray
    frequency_hz: FloatArray
    response: ComplexArray


def loop_margins(loop: Loop) -> Margins:
    """Margins of every draw of `loop`: crossings on its grid, refined on the exact response."""
    frequency = loop.frequency_hz
    response = loop.response(frequency)
    radius = loop.spectral_radius()
    stable = radius < 1
    gain, phase = gain_crossings(loop, response), phase_crossings(loop, response)
    count = len(radius)

    size = np.abs(phase.response)
    above = size > 1
    margin, at = _smallest(count, phase.draw[~above], -_decibel(size[~above]), phase.frequency_hz[~above])
    reduction, _ = _smallest(count, phase.draw[above], _decibel(size[above]), phase.frequency_hz[above])

    lag = np.mod(np.angle(gain.response) + np.pi, 2 * np.pi)
    rotation = np.rad2deg(np.minimum(lag, 2 * np.pi - lag))
    phase_margin, _ = _smallest(count, gain.draw, rotation, gain.frequency_hz)
    delay = lag / (2 * np.pi * gain.frequency_hz)
    delay_margin, _ = _smallest(count, gain.draw, delay, gain.frequency_hz)
    falling = _falling(loop, gain)
    crossover, _ = _smallest(
        count, gain.draw[falling], gain.frequency_hz[falling], gain.frequency_hz[falling]
    )

    def where_stable(values: FloatArray) -> FloatArray:
        return np.where(stable, values, np.nan)

    return Margins(
        radius=radius,
        gain_margin_db=where_stable(margin),
        gain_reduction_db=where_stable(reduction),
        phase_margin_deg=where_stable(phase_margin),
        delay_margin_s=where_stable(delay_margin),
        modulus_margin=where_stable(np.abs(1 + response).min(axis=1)),
        bandwidth_hz=where_stable(bandwidth(frequency, response)),
        crossover_hz=where_stable(np.where(np.isinf(crossover), np.nan, crossover)),
        phase_crossover_hz=where_stable(np.where(np.isinf(margin), np.nan, at)),
    )


def gain_crossings(loop: Loop, response: ComplexArray) -> Crossings:
    """Where |L| = 1; `response` is L on the loop's grid."""
    size = np.abs(response)
    return _crossings(
        loop, np.log(np.maximum(size, np.finfo(float).tiny)), lambda value: np.log(np.abs(value))
    )


def phase_crossings(loop: Loop, response: ComplexArray) -> Crossings:
    """Where L is real and negative, half the sample rate included."""
    found = _crossings(loop, response.imag, lambda value: value.imag)
    negative = found.response.real < 0
    draws = np.arange(len(response))
    end = loop.response(np.array([loop.nyquist_hz]))[:, 0]
    at_end = end.real < 0
    return Crossings(
        np.concatenate([found.draw[negative], draws[at_end]]),
        np.concatenate([found.frequency_hz[negative], np.full(np.count_nonzero(at_end), loop.nyquist_hz)]),
        np.concatenate([found.response[negative], end[at_end]]),
    )


def bandwidth(frequency_hz: FloatArray, response: ComplexArray) -> FloatArray:
    """Lowest frequency at which |L / (1 + L)| falls below -3 dB, (draws,), interpolated on the grid.

    Zero where it is below from the start, infinite where it never falls.
    """
    size = np.abs(response / (1 + response))
    below = size < HALF_POWER
    first = np.argmax(below, axis=1)
    rows = np.arange(len(size))
    before = np.maximum(first - 1, 0)
    low, high = np.log(size[rows, before]), np.log(size[rows, first])
    step = np.where(first > 0, (low - np.log(HALF_POWER)) / np.where(low > high, low - high, 1), 0)
    logarithm = np.log(frequency_hz)
    found = np.exp(logarithm[before] + step * (logarithm[first] - logarithm[before]))
    found = np.where(below[:, 0], 0.0, found)
    return np.where(below.any(axis=1), found, np.inf)


def _crossings(loop: Loop, values: FloatArray, function) -> Crossings:  # type: ignore[no-untyped-def]
    """Zeros of `function` of L, whose `values` (draws, frequencies) stand on the grid; by regula falsi in the
    Illinois variant (Dowell and Jarratt, doi 10.1007/BF01934364)."""
    frequency = loop.frequency_hz
    draw, cell = np.nonzero((values[:, :-1] > 0) != (values[:, 1:] > 0))
    low, high = frequency[cell], frequency[cell + 1]
    at_low, at_high = values[draw, cell], values[draw, cell + 1]
    middle, response = low, np.zeros(len(low), dtype=np.complex128)
    for _ in range(REFINEMENTS):
        middle = high - at_high * (high - low) / (at_high - at_low)
        response = loop.response_at(draw, middle)
        value = function(response)
        crossed = (value > 0) != (at_high > 0)
        low, at_low = np.where(crossed, high, low), np.where(crossed, at_high, at_low / 2)
        high, at_high = middle, value
    return Crossings(draw, middle, response)


def _falling(loop: Loop, gain: Crossings) -> BoolArray:
    """Whether |L| is smaller a little above each crossing."""
    after = loop.response_at(gain.draw, np.minimum(gain.frequency_hz * 1.0001, loop.nyquist_hz))
    return np.asarray(np.abs(after) < np.abs(gain.response), dtype=np.bool_)


def _smallest(
    count: int, draw: IntArray, values: FloatArray, frequency_hz: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The smallest value of every draw and its frequency; infinite where a draw has none."""
    found, at = np.full(count, np.inf), np.full(count, np.inf)
    order = np.argsort(-values, kind="stable")
    found[draw[order]], at[draw[order]] = values[order], frequency_hz[order]
    return found, at


def _decibel(size: FloatArray) -> FloatArray:
    return np.asarray(20 * np.log10(size), dtype=np.float64)
