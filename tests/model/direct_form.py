"""The cascade and its likelihood again, written plainly for the tests: difference equation, 40 digits."""

from __future__ import annotations

import mpmath
import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.model.hammerstein_wiener import HammersteinWiener

mpmath.mp.dps = 40


def expanded(roots: np.ndarray) -> list[mpmath.mpf]:
    """Coefficients of prod(z - root), highest power first."""
    product = [mpmath.mpc(1)]
    for root in roots:
        shifted = [*product, mpmath.mpc(0)]
        for i, coefficient in enumerate(product):
            shifted[i + 1] -= mpmath.mpc(complex(root)) * coefficient
        product = shifted
    return [mpmath.re(coefficient) for coefficient in product]


def simulate(
    model: HammersteinWiener, u: FloatArray, before: float = 0.0
) -> tuple[list[mpmath.mpf], list[mpmath.mpf]]:
    """w and y by the difference equation of G, from rest."""
    lower, upper = mpmath.mpf(model.saturation.lower), mpmath.mpf(model.saturation.upper)
    delay = model.linear.delay_samples
    commands = [before] * delay + [float(value) for value in u]
    v = [min(max(model.saturation.gain * mpmath.mpf(value), lower), upper) for value in commands[: len(u)]]
    b = [model.linear.gain * c for c in expanded(model.linear.zeros)]
    a = expanded(model.linear.poles)
    lag = len(model.linear.poles) - len(model.linear.zeros)
    delta = mpmath.mpf(model.dead_zone.half_width)
    w: list[mpmath.mpf] = []
    y: list[mpmath.mpf] = []
    for k in range(len(u)):
        value = mpmath.mpf(0)
        for j, coefficient in enumerate(b):
            if k - lag - j >= 0:
                value += coefficient * v[k - lag - j]
        for j in range(1, len(a)):
            if k - j >= 0:
                value -= a[j] * w[k - j]
        w.append(value)
        above = model.dead_zone.gain_positive * max(value - delta, 0)
        y.append(above + model.dead_zone.gain_negative * min(value + delta, 0))
    return w, y


def log_likelihood(residual: list[mpmath.mpf], sigma: float, partial: list[float]) -> mpmath.mpf:
    """Exact AR likelihood as a product of one-step predictions, each from the order that its past allows."""
    total = mpmath.mpf(0)
    for k, value in enumerate(residual):
        phi: list[mpmath.mpf] = []
        variance = mpmath.mpf(sigma) ** 2
        for kappa in partial[:k]:
            kappa_ = mpmath.mpf(kappa)
            phi = [p - kappa_ * q for p, q in zip(phi, reversed(phi), strict=True)] + [kappa_]
            variance *= 1 - kappa_**2
        predicted = mpmath.fsum(p * residual[k - i] for i, p in enumerate(phi, start=1))
        total -= (mpmath.log(2 * mpmath.pi * variance) + (value - predicted) ** 2 / variance) / 2
    return total
