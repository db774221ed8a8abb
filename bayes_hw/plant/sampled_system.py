"""The Hammerstein-Wiener system of an axis whose linear part is known as matrices over one sample."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eig

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.plant.nominal import Nominal
from bayes_hw.plant.run import LimitedAxis

LIGHT = 0.25
"""Largest damping ratio of a dominant mode."""

MOST_MODES = 2
CANCELLED = 1e-7
HIGHEST = 0.42
"""Of the sample rate: modes above are not dominant."""

NEGLIGIBLE = 1e-11


class UnfitAxisError(RuntimeError):
    """An axis that is unstable, has no light mode, or whose G is not found to the accuracy needed."""


def system_of(axis: LimitedAxis, a: FloatArray, b: FloatArray, c: FloatArray) -> Nominal:
    """Limits, dead zone and delay of the axis around x' = a x + b v, w = c x; raises UnfitAxisError."""
    poles = np.linalg.eigvals(a).astype(np.complex128)
    poles[np.argmin(np.abs(poles - 1))] = 1.0
    others = poles[poles != 1.0]
    if np.any(np.abs(others) > 0.9985):
        raise UnfitAxisError("an unstable or hardly damped axis")
    markov = _markov(a, b, c, 2 * len(poles) + 2)
    relative = int(np.argmax(np.abs(markov) > NEGLIGIBLE * np.abs(markov).max()))
    zeros = _zeros(a, b, c, len(poles) - relative)
    poles, zeros = _without_cancelled(poles, zeros)
    modes, fixed = _modes(poles, axis.sample_rate_hz)
    found = Nominal(
        axis.lower, axis.upper, axis.dead_zone, float(markov[relative]), modes, zeros, fixed,
        axis.delay_samples, axis.sample_rate_hz,
    )  # fmt: skip
    _check(found, a, b, c)
    return found


def _markov(a: FloatArray, b: FloatArray, c: FloatArray, count: int) -> FloatArray:
    """Samples 0, 1, ... of the impulse response."""
    found, x = [0.0], b
    for _ in range(count):
        found.append(float(c @ x))
        x = a @ x
    return np.array(found)


def _zeros(a: FloatArray, b: FloatArray, c: FloatArray, count: int) -> ComplexArray:
    """The finite zeros of the Rosenbrock pencil."""
    n = len(a)
    left = np.zeros((n + 1, n + 1))
    left[:n, :n], left[:n, n], left[n, :n] = a, b, c
    right = np.zeros_like(left)
    right[:n, :n] = np.eye(n)
    found = eig(left, right, right=False)
    size = np.where(np.isfinite(found), np.abs(found), np.inf)
    kept = found[np.argsort(size)[:count]].astype(np.complex128)
    if not np.isfinite(kept).all():
        raise UnfitAxisError("zeros at infinity")
    real = np.abs(kept.imag) < 1e-9 * np.maximum(np.abs(kept), 1e-3)
    kept[real] = kept[real].real
    return kept


def _without_cancelled(poles: ComplexArray, zeros: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    left, kept = list(zeros), []
    for pole in poles:
        near = min(left, key=lambda z: abs(z - pole), default=None)
        if near is not None and abs(near - pole) < CANCELLED:
            left.remove(near)
        else:
            kept.append(pole)
    return np.array(kept), np.array(left)


def _modes(poles: ComplexArray, rate_hz: float) -> tuple[tuple[tuple[float, float], ...], ComplexArray]:
    """(frequency, damping) of the dominant modes and the other poles."""
    upper = poles[(poles.imag > 1e-9) & (np.abs(poles) > 1e-6)]
    s = np.log(upper) * rate_hz
    light = sorted(
        (abs(x) / (2 * np.pi), -x.real / abs(x), pole)
        for x, pole in zip(s, upper, strict=True)
        if -x.real / abs(x) < LIGHT and abs(x) / (2 * np.pi) < HIGHEST * rate_hz
    )[:MOST_MODES]
    if not light:
        raise UnfitAxisError("no light mode")
    taken = [p for _, _, pole in light for p in (pole, pole.conjugate())]
    fixed = [p for p in poles if all(abs(p - q) > 1e-12 for q in taken)]
    return tuple((float(f), float(z)) for f, z, _ in light), np.array(fixed, dtype=np.complex128)


def _check(found: Nominal, a: FloatArray, b: FloatArray, c: FloatArray) -> None:
    """Raise UnfitAxisError where roots and gain do not answer a square wave as the matrices do."""
    length = 800
    v = np.sign(np.sin(np.arange(length) / 17.0)) * min(found.upper, -found.lower)
    x, exact = np.zeros(len(a)), np.empty(length)
    for k in range(length):
        exact[k] = c @ x
        x = a @ x + b * v[k]
    delayed = np.concatenate([v, np.zeros(found.delay_samples)])
    w = Nominal(
        found.lower, found.upper, 0.0, found.gain, found.modes, found.zeros, found.fixed_poles,
        found.delay_samples, found.sample_rate_hz,
    ).simulate(delayed)[found.delay_samples :]  # fmt: skip
    if not np.max(np.abs(w - exact)) < 1e-7 * np.ptp(exact):
        raise UnfitAxisError("roots not found to the accuracy needed")
