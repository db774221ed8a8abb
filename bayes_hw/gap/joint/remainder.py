"""What the final fit of the joint search leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.noise_causes import NoiseSpectrum, noise_spectrum
from bayes_hw.identify.growth.descent import innovations
from bayes_hw.identify.holes import without_holes
from bayes_hw.identify.identified_model import dominant_modes


@dataclass(frozen=True)
class Remainder:
    """What the final fit leaves: order of its noise, root mean square over innovations, kurtosis of the
    innovations, and the spectra's log-likelihoods."""

    order: int
    ratio: float
    kurtosis: float
    spectrum: NoiseSpectrum


def remainder_of(fit: JointFit) -> Remainder:
    """Of a fit's weighted residuals; for spectra those that were not measured lie between their
    neighbours."""
    residuals = [without_holes(e) for e in fit.point.residuals]
    whitener = fit.point.whitener
    a = np.concatenate(innovations(fit.point))
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
    )
