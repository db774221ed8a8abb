"""The noise of the output: its size, its spectrum, its drift."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.first_look.frequency_response import FrequencyResponse

FIRST_LINES = 4
"""Frequencies at the low end that are left out of the noise's size: there drift is not noise."""

STRETCH_S = 2.0
"""Length of the stretches over which noise is told from errors that repeat."""


@dataclass(frozen=True, eq=False)
class NoiseSpectrum:
    """Two-sided spectral density of the output's noise, output unit^2 / Hz, at `frequency_hz`."""

    frequency_hz: FloatArray
    density: FloatArray

    @property
    def sigma(self) -> float:
        """Standard deviation over these frequencies."""
        f, density = self.frequency_hz[FIRST_LINES:], self.density[FIRST_LINES:]
        if len(f) < 2:
            return 0.0
        end = 2 * f[-1] - f[-2]
        below = float(density[: max(len(density) // 20, 3)].mean() * f[0])
        power = float(np.trapezoid(np.append(density, density[-1]), np.append(f, end))) + below
        return float(np.sqrt(2 * power))


def noise_spectrum(response: FrequencyResponse) -> NoiseSpectrum:
    """That of what the command does not explain of the rate, over that of the difference."""
    return NoiseSpectrum(response.frequency_hz, response.noise_density / response.rate_factor**2)


def quiet_sigma(errors: Sequence[FloatArray], sample_rate_hz: float) -> float:
    """Standard deviation within STRETCH_S about a straight line: the median over the quieter half of all such
    stretches, so that what a stretch holds besides noise does not count; 0 where records are shorter.
    """
    width = max(8, round(STRETCH_S * sample_rate_hz))
    rows = [error[: len(error) // width * width].reshape(-1, width) for error in errors]
    stretches = np.concatenate(rows)
    if len(stretches) == 0:
        return 0.0
    line = np.linspace(-1, 1, width)
    level = stretches - stretches.mean(axis=1, keepdims=True)
    left = level - np.outer(level @ line / (line @ line), line)
    variances = np.sort((left**2).sum(axis=1) / (width - 2))
    return float(np.sqrt(np.median(variances[: -(-len(variances) // 2)])))


def drift(error: FloatArray, sample_rate_hz: float) -> tuple[float, float]:
    """Slope of the error over time in output units per hour, and its standard error from twenty block
    means.
    """
    blocks = np.array([block.mean() for block in np.array_split(error, 20)])
    hours = np.linspace(0.025, 0.975, 20) * len(error) / sample_rate_hz / 3600
    centred = hours - hours.mean()
    slope = float(centred @ blocks / (centred @ centred))
    left = blocks - blocks.mean() - slope * centred
    return slope, float(np.sqrt(left @ left / 18 / (centred @ centred)))
