"""Noise that grows with the speed of the axis: instants of the readings that are off."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize
from scipy.stats import kurtosis

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.identify.growth.descent import innovations

LEAST_NATS = 60.0

FEWEST = 50
"""Samples that tell of a variance."""

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
    """Simulated speeds of the output, output units a sample: the root mean square of the steps to a sample
    and from it, with the sign of both together. Where the axis turns within a sample it is not at rest."""
    values = fit.values
    return [signed_speed(fit.response.along(values, i).y) for i in range(len(fit.response.records))]


def signed_speed(y: FloatArray) -> FloatArray:
    """Of every sample (samples,) of an angle."""
    before, after = np.diff(y, prepend=y[:1]), np.diff(y, append=y[-1:])
    before[0], after[-1] = after[0], before[-1]
    return np.where(before + after < 0, -1.0, 1.0) * np.sqrt((before**2 + after**2) / 2)


def less_for_tails(nats: float, white: FloatArray) -> float:
    """Nats of a variance that changes, of noise whose values (n,) divided by their deviations are `white`.

    Squares of heavy-tailed noise scatter more than those of normal noise, and the ratio of likelihoods with
    them: it is divided by one and half of the excess kurtosis (Layard, 1973, doi 10.2307/2284766).
    """
    tails = max(float(kurtosis(white)), 0.0) if len(white) > 3 and np.ptp(white) > 0 else 0.0
    return nats / (1 + tails / 2)


def speed_noise(fit: JointFit, residuals: Sequence[FloatArray], slowest: float = 0.0) -> SpeedNoise:
    """Of unweighted residuals where the axis is faster than the `slowest` speed, output units a sample;
    innovations under the fit's noise are taken: slow error tells nothing.

    Nats are divided by what heavy tails add to the scatter of squares (`less_for_tails`): what
    jumps now and then, and most while the axis is fast, is no error of timing.
    """
    a = np.concatenate(innovations(fit.point, residuals))
    steps = speeds(fit)
    told = fit.response.told
    residuals = [np.where(mask, e, 0.0) for mask, e in zip(told, residuals, strict=True)]
    d = np.concatenate([s[mask] for mask, s in zip(told, steps, strict=True)]) ** 2
    a, d = a[d >= slowest**2], d[d >= slowest**2]
    samples = len(a)
    unit = float(np.mean(d)) if samples else 0.0
    if samples < FEWEST or unit == 0:
        return SpeedNoise(0.0, 0.0, 1.0)
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
    gained = 0.5 * samples * (np.log(total) + 1) - found.fun
    gained = less_for_tails(gained, a / np.sqrt(np.exp(found.x[0]) + np.exp(found.x[1]) * d))
    # Of differences: what is slow, whatever its cause, drops out; of a part of memory m their neighbours
    # correlate by -(1 - m) / 2.
    turned = [np.sign(s[1:]) * np.diff(e) for s, e in zip(steps, residuals, strict=True)]
    product = np.concatenate([h[1:] * h[:-1] for h in turned])
    power = np.concatenate([(h[1:] ** 2 + h[:-1] ** 2) / 2 for h in turned])
    speed = np.concatenate([s[2:] ** 2 for s in steps])
    among = speed[speed >= slowest**2]
    fast = speed > np.quantile(among, 0.6)
    at_rest = (speed <= np.quantile(among, 0.3)) & (speed >= slowest**2)
    grown = float(np.mean(power[fast]) - np.mean(power[at_rest]))
    followed = float(np.mean(product[fast]) - np.mean(product[at_rest]))
    memory = 1.0 + 2.0 * followed / max(grown, 1e-300)
    return SpeedNoise(
        float(gained - 0.5 * np.log(samples)), float(np.sqrt(np.exp(found.x[1]) / unit)), memory
    )
