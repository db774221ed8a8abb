"""What the final fit of the joint search leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.noise_causes import NoiseSpectrum, noise_spectrum
from bayes_hw.gap.joint.noise_rhythm import rhythm_nats
from bayes_hw.identify.growth.descent import innovations
from bayes_hw.identify.holes import without_holes
from bayes_hw.identify.resonances import dominant_modes

LONGEST_LAG = 200


@dataclass(frozen=True)
class Remainder:
    """What the final fit leaves: order of its noise, root mean square over innovations, kurtosis of the
    innovations, the spectra's log-likelihoods, nats of a variance that changes in a rhythm."""

    order: int
    ratio: float
    kurtosis: float
    spectrum: NoiseSpectrum
    rhythm: float = 0.0

    @property
    def slow_nats(self) -> float:
        """By which wind or an angle that walks explains the noise better than an autoregression does."""
        spectrum = self.spectrum
        plain = max(spectrum.autoregression, spectrum.first_order)
        return max(spectrum.torque - plain, spectrum.walk - plain, 0.0)


def remainder_of(fit: JointFit) -> Remainder:
    """Of a fit's weighted residuals; for spectra those that were not measured lie between their
    neighbours."""
    residuals = [without_holes(e) for e in fit.point.residuals]
    whitener = fit.point.whitener
    found = innovations(fit.point)
    a = np.concatenate(found)
    rate = fit.response.scale.rate_hz
    modes = [
        (m.frequency_hz, m.damping_ratio)
        for m in dominant_modes(fit.structure, fit.values.cascade, rate, fit.response.scale.samples / rate)
    ]
    return Remainder(
        whitener.order,
        float(fit.point.rms / np.sqrt(np.mean(a**2))),
        float(np.mean(a**4) / np.mean(a**2) ** 2 - 3),
        noise_spectrum(fit, residuals, modes),
        rhythm_nats(found),
    )


def samples_of_variance(residuals: Sequence[FloatArray]) -> float:
    """Independent samples that would tell the residuals' variance as well: n / (1 + 2 sum of the squared
    autocorrelations) (Bartlett 1946)."""
    samples = sum(len(e) for e in residuals)
    power = sum(float(e @ e) for e in residuals)
    lags = min(LONGEST_LAG, min(len(e) for e in residuals) - 1)
    products = [sum(float(e[k:] @ e[:-k]) for e in residuals) for k in range(1, lags + 1)]
    squared = np.sum((np.array(products) / power) ** 2) - lags / samples if power > 0 else 0.0
    return float(samples / (1 + 2 * max(float(squared), 0.0)))
