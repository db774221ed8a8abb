"""Noise that grows with the speed: errors of timing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.identify.growth.descent import innovations

LEAST_NATS = 60.0
LONGEST_MEMORY = 0.65
"""A held reading follows the one before by the share that is held; slow error by nearly one."""


@dataclass(frozen=True)
class SpeedNoise:
    """Noise whose variance grows with the square of the speed: nats over a constant one, the standard
    deviation of the instants in samples, and how far the part that grows follows itself from sample to
    sample."""

    nats: float
    jitter: float
    memory: float

    @property
    def present(self) -> bool:
        return self.nats > LEAST_NATS and self.memory < LONGEST_MEMORY


def speeds(fit: JointFit) -> list[FloatArray]:
    """Simulated steps of the output, output units a sample, by central differences."""
    values = fit.values
    return [np.gradient(fit.response.along(values, i).y) for i in range(len(fit.response.records))]


def speed_noise(fit: JointFit, residuals: Sequence[FloatArray]) -> SpeedNoise:
    """Of unweighted residuals; innovations under the fit's noise are taken: slow error tells nothing."""
    a = np.concatenate(innovations(fit.point, residuals))
    steps = speeds(fit)
    records = fit.response.records
    residuals = [np.where(r.measured_samples, e, 0.0) for r, e in zip(records, residuals, strict=True)]
    d = np.concatenate([s[r.measured_samples] for r, s in zip(records, steps, strict=True)]) ** 2
    samples = len(a)
    unit = float(np.mean(d))
    if unit == 0:
        return SpeedNoise(-0.5 * float(np.log(samples)), 0.0, 1.0)
    d = d / unit

    def minus(x: FloatArray) -> float:
        variance = np.exp(x[0]) + np.exp(x[1]) * d
        return 0.5 * float(np.sum(np.log(variance) + a**2 / variance))

    total = float(np.mean(a**2)) or 1e-300
    found = min(
        (
            minimize(minus, np.log([total * s, total * (1 - s) + 1e-300]), method="Nelder-Mead",
                     options={"maxiter": 120, "xatol": 0.01, "fatol": 0.05})
            for s in (0.9, 0.2)
        ),
        key=lambda r: r.fun,
    )  # fmt: skip
    flat = 0.5 * samples * (np.log(total) + 1)
    # Of differences: what is slow, whatever its cause, drops out; of a part of memory m their neighbours
    # correlate by -(1 - m) / 2.
    turned = [np.sign(s[1:]) * np.diff(e) for s, e in zip(steps, residuals, strict=True)]
    product = np.concatenate([h[1:] * h[:-1] for h in turned])
    power = np.concatenate([(h[1:] ** 2 + h[:-1] ** 2) / 2 for h in turned])
    speed = np.concatenate([s[2:] ** 2 for s in steps])
    fast, at_rest = speed > np.quantile(speed, 0.6), speed <= np.quantile(speed, 0.3)
    grown = float(np.mean(power[fast]) - np.mean(power[at_rest]))
    followed = float(np.mean(product[fast]) - np.mean(product[at_rest]))
    memory = 1.0 + 2.0 * followed / max(grown, 1e-300)
    return SpeedNoise(
        float(flat - found.fun - 0.5 * np.log(samples)), float(np.sqrt(np.exp(found.x[1]) / unit)), memory
    )
