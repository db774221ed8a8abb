"""Wind: a slow coloured torque that no record shows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.plant.effects.effect import Effect, Parameters, Scales, log_uniform
from bayes_hw.plant.integrator import EXTERNAL_LOAD, EXTERNAL_STRUCTURE
from bayes_hw.plant.run import RecordRun

DAVENPORT_LENGTH_M = 1200.0
STREAM = 101


def davenport_spectrum(frequency_hz: FloatArray, wind_speed: float) -> FloatArray:
    """S(f) ~ x^2 / (f (1 + x^2)^(4/3)), x = 1200 m f / U10 (Davenport 1961, doi 10.1002/qj.49708737208)."""
    x = DAVENPORT_LENGTH_M * frequency_hz / wind_speed
    return np.asarray(x**2 / (1 + x**2) ** (4 / 3) / frequency_hz, dtype=np.float64)


def kaimal_spectrum(frequency_hz: FloatArray, wind_speed: float, height_m: float) -> FloatArray:
    """S(f) ~ n / (f (1 + 33 n)^(5/3)), n = f z / U (Kaimal et al. 1972, doi 10.1002/qj.49709841707)."""
    n = frequency_hz * height_m / wind_speed
    return np.asarray(n / (1 + 33 * n) ** (5 / 3) / frequency_hz, dtype=np.float64)


def aerodynamic_admittance(frequency_hz: FloatArray, wind_speed: float, diameter_m: float) -> FloatArray:
    """1 / (1 + (2 f D / U)^(4/3))^2: gusts smaller than the dish average out (Vickery 1966)."""
    return np.asarray(
        1 / (1 + (2 * frequency_hz * diameter_m / wind_speed) ** (4 / 3)) ** 2, dtype=np.float64
    )


@dataclass(frozen=True)
class Wind(Effect):
    """Gusts with a Davenport or Kaimal spectrum on a dish of `diameter_m` in wind of `wind_speed` m/s."""

    label: ClassVar[str] = "wind"
    torque: float
    wind_speed: float
    diameter_m: float
    at_structure: bool

    @classmethod
    def draw(cls, rng: np.random.Generator, scales: Scales) -> Wind:
        diameter = float(np.clip((20 / scales.modes_hz[0]) ** (1 / 0.7), 5, 110))
        return cls(
            str(rng.choice(["davenport", "kaimal"])),
            0.03 * scales.torque,
            log_uniform(rng, 4, 20),
            diameter,
            bool(rng.random() < 0.5),
        )

    def act(self, run: RecordRun, strength: float) -> None:
        column = EXTERNAL_STRUCTURE if self.at_structure else EXTERNAL_LOAD
        run.external[:, column] += strength * self.torque * self._gusts(run)

    def _gusts(self, run: RecordRun) -> FloatArray:
        """A Gaussian series of unit variance (over all time) at the integration step, shape (steps,).

        It fades in over two seconds, as the record starts at rest.
        """
        length = 1 << int(np.ceil(np.log2(max(run.duration_s * 4, 600.0) * run.axis.sample_rate_hz)))
        frequency = np.fft.rfftfreq(length, 1 / run.axis.sample_rate_hz)[1:].astype(np.float64)
        if self.detail == "davenport":
            power = davenport_spectrum(frequency, self.wind_speed)
        else:
            power = kaimal_spectrum(frequency, self.wind_speed, self.diameter_m)
        power = power * aerodynamic_admittance(frequency, self.wind_speed, self.diameter_m)
        rng = run.rng(STREAM)
        coefficients = (rng.standard_normal(len(power)) + 1j * rng.standard_normal(len(power))) * np.sqrt(
            power / power.sum()
        )
        series = np.fft.irfft(np.concatenate([[0.0], coefficients]), length) * length / 2
        coarse = series[: run.samples + 1] * np.clip(
            np.arange(run.samples + 1) / run.axis.sample_rate_hz / 2, 0, 1
        )
        return np.interp(run.fine_time, np.arange(run.samples + 1) / run.axis.sample_rate_hz, coarse)

    def parameters(self, strength: float) -> Parameters:
        return {
            "kind": self.detail,
            "rms_deg_s2": strength * self.torque,
            "wind_speed_m_s": self.wind_speed,
        }
