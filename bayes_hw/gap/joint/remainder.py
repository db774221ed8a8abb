"""What the final fit of the joint search leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.noise_causes import NoiseSpectrum, noise_spectrum
from bayes_hw.gap.joint.noise_rhythm import burst_nats, rhythm_nats
from bayes_hw.identify.identified_model import dominant_modes


@dataclass(frozen=True)
class Remainder:
    """What the final fit leaves: order of its noise, root mean square over innovations, kurtosis of the
    innovations, the spectra's log-likelihoods, nats of variances that change in bursts and in a rhythm."""

    order: int
    ratio: float
    kurtosis: float
    spectrum: NoiseSpectrum
    burst: float = 0.0
    rhythm: float = 0.0


def remainder_of(fit: JointFit) -> Remainder:
    """Of a fit's weighted residuals."""
    residuals = fit.point.residuals
    whitener = fit.point.whitener
    innovations = [whitener.apply(e[None, :])[0] for e in residuals]
    a = np.concatenate(innovations)
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
        burst_nats(innovations),
        rhythm_nats(innovations),
    )
