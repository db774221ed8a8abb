"""Axes whose parameters and noise are known, with records of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import signal

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.noise import autoregression_from_partial, stationary_autoregression
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.record import Record

WARM_UP = 500
"""Samples of noise with heavy tails that are thrown away before the record begins."""

STATIC = ("saturation.lower", "saturation.upper", "dead_zone.half_width", "velocity_gain", "noise.sigma")


@dataclass(frozen=True)
class TrueNoise:
    """Stationary autoregression of marginal standard deviation `sigma` (output units) and partial
    autocorrelations `partial`; innovations normal, or Student t with `degrees_of_freedom` above two."""

    sigma: float
    partial: tuple[float, ...] = ()
    degrees_of_freedom: float | None = None

    @property
    def autoregression(self) -> FloatArray:
        """phi_1 ... phi_p."""
        return autoregression_from_partial(np.array(self.partial)[:, None])[:, 0]

    @property
    def innovation_sigma(self) -> float:
        """Standard deviation of the innovations, output units."""
        return self.sigma * float(np.sqrt(np.prod(1 - np.square(self.partial))))

    def sequence(self, samples: int, rng: np.random.Generator) -> FloatArray:
        """Noise of shape (samples,)."""
        if self.degrees_of_freedom is None:
            return stationary_autoregression(samples, self.sigma, np.array(self.partial), rng)
        nu = self.degrees_of_freedom
        shocks = rng.standard_t(nu, WARM_UP + samples) * np.sqrt((nu - 2) / nu) * self.innovation_sigma
        polynomial = np.concatenate([[1.0], -self.autoregression])
        return np.asarray(signal.lfilter([1.0], polynomial, shocks), dtype=np.float64)[WARM_UP:]

    @property
    def information(self) -> float:
        """Fisher information about the location of an innovation, one over output units squared.

        (nu + 1) / ((nu + 3) s^2) for Student t of scale s (Lange, Little and Taylor,
        doi 10.1080/01621459.1989.10478852).
        """
        variance = self.innovation_sigma**2
        if self.degrees_of_freedom is None:
            return 1 / variance
        nu = self.degrees_of_freedom
        return (nu + 1) / (nu + 3) * nu / ((nu - 2) * variance)

    def location_score(self, innovations: FloatArray) -> FloatArray:
        """Slope of the logarithm of an innovation's density by its location, one over output units."""
        variance = self.innovation_sigma**2
        if self.degrees_of_freedom is None:
            return innovations / variance
        nu = self.degrees_of_freedom
        return (nu + 1) * innovations / ((nu - 2) * variance + innovations**2)


@dataclass(frozen=True, eq=False)
class KnownAxis:
    """An axis whose true parameters are known, its noise, and records of it.

    A record that begins in motion goes on from rest under the commands `earlier` (samples,), of which there
    are those of every record, or none at all.
    """

    model: HammersteinWiener
    noise: TrueNoise
    records: tuple[Record, ...]
    earlier: tuple[FloatArray, ...] = ()

    @property
    def commands(self) -> list[FloatArray]:
        """Of every record, from rest to its end."""
        if not self.earlier:
            return [record.u for record in self.records]
        return [np.append(before, r.u) for before, r in zip(self.earlier, self.records, strict=True)]

    def true_values(self) -> dict[str, float]:
        """Limits, half width, steady velocity a command, noise and modes by the names of posterior.json."""
        model = self.model
        static = (
            model.saturation.lower,
            model.saturation.upper,
            model.dead_zone.half_width,
            model.linear.velocity_gain(model.sample_rate_hz),
            self.noise.sigma,
        )
        found = dict(zip(STATIC, static, strict=True))
        for number, mode in enumerate(model.dominant_modes, start=1):
            found[f"mode{number}.frequency_hz"] = mode.frequency_hz
            found[f"mode{number}.damping_ratio"] = mode.damping_ratio
        return found
