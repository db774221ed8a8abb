"""The linear block G(z): poles, zeros, gain and delay."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.errors import InputError

STABILITY_MARGIN = 1e-9
"""A pole may exceed modulus one by this much and still count as an integrator's rounding error."""

INTEGRATOR_RADIUS = 1e-6
"""A real pole this close to z = 1 is the integrator."""


@dataclass(frozen=True)
class Mode:
    """A lightly damped pole pair, s = 2 pi f (-zeta + i sqrt(1 - zeta^2))."""

    frequency_hz: float
    damping_ratio: float

    def pole(self, sample_rate_hz: float) -> complex:
        """The pole with positive imaginary part, exp(s / sample_rate)."""
        return complex(mode_pole(self.frequency_hz, self.damping_ratio, sample_rate_hz))

    @classmethod
    def from_pole(cls, pole: complex, sample_rate_hz: float) -> Mode:
        """The mode whose sampled pole pair contains `pole`; the inverse of `pole`."""
        s = np.log(complex(pole)) * sample_rate_hz
        magnitude = abs(s)
        return cls(float(magnitude / (2 * np.pi)), float(-s.real / magnitude))


def mode_pole(
    frequency_hz: FloatArray | float, damping_ratio: FloatArray | float, sample_rate_hz: float
) -> ComplexArray:
    """Sampled poles of continuous modes, exp(2 pi f (-zeta + i sqrt(1 - zeta^2)) / rate).

    `frequency_hz` and `damping_ratio` broadcast against each other; |damping_ratio| < 1.
    """
    frequency = np.asarray(frequency_hz, dtype=np.float64)
    damping = np.asarray(damping_ratio, dtype=np.float64)
    angle = 2 * np.pi / sample_rate_hz * frequency
    radius, turned = np.exp(-angle * damping), angle * np.sqrt(1 - damping**2)
    pole = np.empty(np.shape(radius), dtype=np.complex128)
    pole.real, pole.imag = radius * np.cos(turned), radius * np.sin(turned)
    return pole


@dataclass(frozen=True, eq=False)
class LinearBlock:
    """w(k) = G(z) v(k) with G = z^-delay gain prod(z - zeros) / prod(z - poles) (eq. 2 of the paper).

    `zeros` and `poles` are complex arrays closed under conjugation, with no more zeros than poles.
    """

    zeros: ComplexArray
    poles: ComplexArray
    gain: float
    delay_samples: int

    def __post_init__(self) -> None:
        for label, roots in (("zeros", self.zeros), ("poles", self.poles)):
            if not np.all(np.isfinite(roots)):
                raise InputError(f"linear.{label}: every root must be finite")
            if not _closed_under_conjugation(roots):
                raise InputError(f"linear.{label}: complex roots must come in conjugate pairs")
        if len(self.zeros) > len(self.poles):
            raise InputError(
                f"linear: improper, {len(self.zeros)} zeros but {len(self.poles)} poles; "
                "a real axis has at least as many poles as zeros"
            )
        if self.delay_samples < 0:
            raise InputError("linear.delay_samples: must be zero or more")
        if not np.isfinite(self.gain) or self.gain == 0:
            raise InputError("linear.gain: must be finite and not zero")

    @classmethod
    def from_coefficients(cls, numerator: Sequence[float], denominator: Sequence[float]) -> LinearBlock:
        """Read B and A in powers of 1/z, constant term first (eq. 2 of the paper).

        Leading zeros of the numerator are the delay; an exact root of A at z = 1 is kept exact.
        """
        b = np.trim_zeros(np.asarray(numerator, dtype=np.float64), "b")
        a = np.trim_zeros(np.asarray(denominator, dtype=np.float64), "b")
        for label, values in (("numerator", b), ("denominator", a)):
            if not np.all(np.isfinite(values)):
                raise InputError(f"linear.{label}: every coefficient must be finite")
        if a.size == 0 or a[0] == 0:
            raise InputError("linear.denominator: its first coefficient must not be zero")
        if b.size == 0:
            raise InputError("linear.numerator: all coefficients are zero")
        lead = int(np.flatnonzero(b)[0])
        try:
            with np.errstate(all="ignore"):
                b, a = b[lead:] / a[0], a / a[0]
                zeros, poles = polynomial_roots(b), polynomial_roots(a)
        except np.linalg.LinAlgError:
            raise InputError(
                "linear: the roots of numerator and denominator overflow; "
                "give coefficients of like size, the first ones not near zero"
            ) from None
        delay = lead + len(zeros) - len(poles)
        if delay < 0:
            zeros, delay = np.concatenate([zeros, np.zeros(-delay, complex)]), 0
        elif len(zeros) > len(poles):
            poles = np.concatenate([poles, np.zeros(len(zeros) - len(poles), complex)])
            delay = lead
        return cls(zeros, poles, float(b[0]), delay)

    @property
    def smallest_separation(self) -> float:
        """Distance (in z) of the two poles nearest each other, infinite for fewer than two."""
        if len(self.poles) < 2:
            return float("inf")
        distance = np.abs(self.poles[:, None] - self.poles[None, :])
        return float(np.min(distance[np.triu_indices(len(self.poles), 1)]))

    @property
    def total_delay(self) -> int:
        """Samples before a step of v first shows in w."""
        return self.delay_samples + len(self.poles) - len(self.zeros)

    def coefficients(self) -> tuple[FloatArray, FloatArray]:
        """Numerator and denominator in powers of 1/z, constant term first, delay included."""
        numerator = np.real(np.poly(self.zeros)) * self.gain
        return (
            np.concatenate([np.zeros(self.total_delay), np.atleast_1d(numerator)]),
            np.atleast_1d(np.real(np.poly(self.poles))),
        )

    @property
    def integrator_index(self) -> int | None:
        """Index of the pole at z = 1, or None."""
        distance = np.abs(self.poles - 1)
        if distance.size == 0 or distance.min() > INTEGRATOR_RADIUS:
            return None
        return int(np.argmin(distance))

    def check_stable(self) -> None:
        """Raise InputError unless G is stable but for one integrator."""
        radius = np.abs(self.poles)
        limit = 1 + STABILITY_MARGIN
        outside = np.flatnonzero(radius > limit)
        if outside.size:
            worst = outside[np.argmax(radius[outside])]
            raise InputError(
                f"linear.poles: unstable, |pole| = {radius[worst]:.6g} > 1; "
                "identify a stable model first, or give more digits of the coefficients"
            )
        on_circle = np.abs(radius - 1) < STABILITY_MARGIN
        if np.count_nonzero(on_circle) > 1:
            raise InputError(
                f"linear.poles: unstable, {np.count_nonzero(on_circle)} poles on the unit circle; "
                "at most one integrator is allowed"
            )

    def frequency_response(self, frequency_hz: FloatArray, sample_rate_hz: float) -> ComplexArray:
        """G(exp(2 pi i f / rate)) at every frequency, in output units per unit of v."""
        z = np.exp(2j * np.pi * np.asarray(frequency_hz) / sample_rate_hz)
        numerator = self.gain * np.prod(z[..., None] - self.zeros, axis=-1)
        denominator = np.prod(z[..., None] - self.poles, axis=-1)
        return np.asarray(numerator / denominator * z ** (-self.delay_samples), dtype=np.complex128)

    def velocity_gain(self, sample_rate_hz: float) -> float:
        """Steady output velocity per unit of v, (1/s) output units: rate times the integrator's residue.

        NaN when there is no integrator.
        """
        index = self.integrator_index
        if index is None:
            return float("nan")
        others = np.delete(self.poles, index)
        residue = self.gain * np.prod(1 - self.zeros) / np.prod(1 - others)
        return float(residue.real * sample_rate_hz)

    def modes(self, sample_rate_hz: float) -> list[Mode]:
        """Every complex pole pair as a mode, in order of frequency."""
        upper = self.poles[self.poles.imag > 0]
        found = [Mode.from_pole(complex(pole), sample_rate_hz) for pole in upper]
        return sorted(found, key=lambda mode: mode.frequency_hz)

    def filter(self, v: FloatArray) -> FloatArray:
        """w = G v from rest by a cascade of second-order sections.

        Valid for every pole configuration, coinciding poles included; the compiled kernel is the fast
        way for distinct poles.
        """
        delayed = np.zeros_like(v, dtype=np.float64)
        delay = self.total_delay
        if delay < len(v):
            delayed[delay:] = v[: len(v) - delay]
        padded_zeros = np.concatenate([self.zeros, np.zeros(len(self.poles) - len(self.zeros))])
        sections = signal.zpk2sos(list(padded_zeros), list(self.poles), self.gain)
        return np.asarray(signal.sosfilt(sections, delayed), dtype=np.float64)


def polynomial_roots(coefficients: FloatArray) -> ComplexArray:
    """Roots of c[0] z^n + ... + c[n], polished in extended precision.

    A root at z = 1 that the coefficients hold to rounding error is divided out exactly first: three roots
    near z = 1 would otherwise carry errors of the cube root of the rounding error.
    """
    c = np.asarray(coefficients, dtype=np.float64)
    exact: list[complex] = []
    if len(c) > 1 and abs(c.sum()) <= 8 * np.finfo(float).eps * np.abs(c).sum():
        exact.append(1.0 + 0.0j)
        c = np.cumsum(c)[:-1]
    roots = np.roots(c)
    real = roots[roots.imag == 0].astype(np.clongdouble)
    upper = roots[roots.imag > 0].astype(np.clongdouble)
    polished = _polished(c.astype(np.longdouble), np.concatenate([real, upper]), len(real))
    real, upper = polished[: len(real)].astype(complex), polished[len(real) :].astype(complex)
    pairs = np.column_stack([upper, upper.conj()]).ravel()
    return np.concatenate([np.array(exact, dtype=np.complex128), real, pairs])


def _polished(
    coefficients: NDArray[np.longdouble], roots: NDArray[np.clongdouble], real: int
) -> NDArray[np.clongdouble]:
    """Ehrlich-Aberth steps (doi 10.1145/363067.363115) on `real` real roots, then on one root of each pair.

    They end when the product of the roots' factors no longer comes closer to the coefficients: at roots that
    coincide to rounding error the steps are noise.
    """
    derivative = np.polyder(coefficients)
    error = _expansion_error(coefficients, roots, real)
    for _ in range(6):
        everything = np.concatenate([roots, roots[real:].conj()])
        value = np.polyval(coefficients, roots)
        difference = roots[:, None] - everything[None, :]
        inverse = 1 / np.where(difference == 0, np.inf, difference)
        slope = np.polyval(derivative, roots) - value * inverse.sum(axis=1)
        moved = roots - np.where(slope != 0, value / np.where(slope == 0, 1, slope), 0)
        moved[:real] = moved[:real].real
        moved_error = _expansion_error(coefficients, moved, real)
        if not moved_error < error or np.any(moved[real:].imag <= 0):
            break
        roots, error = moved, moved_error
    return roots


def _expansion_error(
    coefficients: NDArray[np.longdouble], roots: NDArray[np.clongdouble], real: int
) -> float:
    """Largest difference between the coefficients and c[0] prod(z - root)."""
    product = coefficients[:1]
    for root in roots[:real].real:
        product = np.convolve(product, np.array([1, -root]))
    for root in roots[real:]:
        product = np.convolve(product, np.array([1, -2 * root.real, root.real**2 + root.imag**2]))
    return float(np.abs(product - coefficients).max())


def _closed_under_conjugation(roots: ComplexArray) -> bool:
    upper = np.sort_complex(roots[roots.imag > 0])
    lower = np.sort_complex(roots[roots.imag < 0].conj())
    return len(upper) == len(lower) and bool(np.allclose(upper, lower, rtol=1e-9, atol=1e-12))
