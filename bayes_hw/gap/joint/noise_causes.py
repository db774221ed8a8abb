"""Causes that show in the noise that a fit leaves: errors of timing, wind, an angle that walks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.optimize import minimize

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.joint_fit import JointFit
from bayes_hw.gap.joint.periodogram import tapered_periodograms
from bayes_hw.identify.growth.descent import innovations

Shape: TypeAlias = Callable[[FloatArray], FloatArray]
"""Spectrum of parameters."""

LEAST_NATS = 60.0
FLOORS = (0.1, 0.8)
"""Starts of the colour of the encoder's own noise: inverse hyperbolic tangents."""

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
    unit = float(np.mean(d)) or 1.0
    d = d / unit
    samples = len(a)

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


@dataclass(frozen=True)
class NoiseSpectrum:
    """Whittle log-likelihoods in nats, less half a logarithm of the ordinates a parameter: white noise, an
    autoregression as fitted, noise of the first order with a random walk, or with a slow torque through G."""

    white: float
    autoregression: float
    first_order: float
    walk: float
    torque: float
    corner_hz: float


def noise_spectrum(
    fit: JointFit, residuals: Sequence[FloatArray], modes: Sequence[tuple[float, float]]
) -> NoiseSpectrum:
    """`modes` are frequencies (Hz) and damping ratios of G's resonances.

    By periodograms of tapered first differences (Whittle 1953).
    """
    rate = fit.response.scale.rate_hz
    f, p = tapered_periodograms(residuals, rate)
    differenced = 4 * np.sin(np.pi * f / rate) ** 2
    price = 0.5 * float(np.log(max(len(f), 2)))

    def value(spectrum: FloatArray) -> float:
        s = np.maximum(spectrum * differenced, 1e-300)
        scale = float(np.mean(p / s))
        return -float(np.sum(np.log(s * scale))) - len(f)

    flat = np.ones_like(f)
    z = np.exp(-2j * np.pi * f / rate)

    def autoregressive(coefficients: FloatArray) -> FloatArray:
        polynomial = 1 - sum(c * z ** (i + 1) for i, c in enumerate(coefficients))
        return 1 / np.abs(polynomial) ** 2

    order = fit.point.whitener.order
    fitted = autoregressive(fit.point.whitener.coefficients[order, :order]) if order else flat
    resonance = np.ones_like(f)
    for frequency, damping in modes:
        r = f / frequency
        resonance = resonance / ((1 - r**2) ** 2 + (2 * damping * r) ** 2)

    def best(shape: Shape, starts: Sequence[FloatArray]) -> tuple[float, FloatArray]:
        def minus(x: FloatArray) -> float:
            return -value(shape(x))

        found = [
            minimize(minus, tuple(start), method="Nelder-Mead", options={"maxiter": 200, "fatol": 0.05})
            for start in starts
        ]
        top = min(found, key=lambda r: float(r.fun))
        return -float(top.fun), np.asarray(top.x)

    def first(x: FloatArray) -> FloatArray:
        return autoregressive(np.array([np.tanh(x[0])]))

    def floor(x: FloatArray) -> FloatArray:
        """Of the encoder alone: of the first order, at one where its own noise is white."""
        return first(x) * (1 - np.tanh(x[0])) ** 2

    def walking(x: FloatArray) -> FloatArray:
        return floor(x[1:]) + np.exp(np.clip(x[0], -40, 40)) / differenced

    def blown(power: float, bent: bool) -> Shape:
        def shape(x: FloatArray) -> FloatArray:
            slow = np.exp(np.clip(x[0], -40, 40)) / (1 + (f / np.exp(x[1])) ** 2) ** power
            return floor(x[2:]) + slow * (resonance if bent else 1.0)

        return shape

    walk, _ = best(walking, [np.array([a, c]) for a in (-8.0, -4.0, 0.0) for c in FLOORS])
    one, _ = best(first, [np.array([a]) for a in (0.3, 1.5)])
    torques = []
    corners = [np.array([a, np.log(c), b]) for a, c in ((2.0, 0.3), (6.0, 0.05)) for b in FLOORS]
    for power in (1.0, 1.5, 2.2):
        for bent in (True, False):
            got, x = best(blown(power, bent), corners)
            torques.append((got - 4 * price, float(np.exp(x[1]))))
    torque, corner = max(torques)
    return NoiseSpectrum(
        value(flat), value(fitted) - order * price, one - price, walk - 2 * price, torque, corner
    )
