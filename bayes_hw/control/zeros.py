"""Zeros and antiresonances of G over the draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eig

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.control.axis_draws import AxisDraws

LIGHT_DAMPING = 0.3
"""A zero pair less damped than this makes a dip in the response."""

LARGEST = 1e3
"""A zero of larger modulus is rounding error of one at infinity."""


@dataclass(frozen=True, eq=False)
class Antiresonance:
    """A zero pair of the nominal G and the pair nearest to it in every draw.

    `frequency_hz` and `damping_ratio` (draws,); a damping below zero means a zero outside the unit circle.
    """

    nominal_hz: float
    nominal_damping: float
    frequency_hz: FloatArray
    damping_ratio: FloatArray


def zeros(axis: AxisDraws) -> ComplexArray:
    """The zeros of every draw, (poles, draws), in order of modulus; infinite where there are fewer.

    With A = diag(p), B = 1, C = r and D the direct term: generalized eigenvalues of [A B; C D] and [I 0; 0 0]
    (Rosenbrock's pencil; Emami-Naeini and Van Dooren, doi 10.1016/0005-1098(82)90070-X).
    """
    poles, residues = axis.poles.T, axis.residues.T
    n = poles.shape[1]
    kept = np.eye(n + 1)
    kept[n, n] = 0
    found = np.empty((axis.count, n), dtype=np.complex128)
    for draw in range(axis.count):
        pencil = np.ones((n + 1, n + 1), dtype=np.complex128)
        pencil[:n, :n] = np.diag(poles[draw])
        scale = np.abs(residues[draw]).max()
        pencil[n, :n], pencil[n, n] = residues[draw] / scale, axis.direct[draw] / scale
        top, bottom = eig(pencil, kept, right=False, homogeneous_eigvals=True)
        finite = np.abs(bottom) * LARGEST > np.abs(top)
        roots = np.sort_complex(top[finite] / bottom[finite])
        found[draw] = np.inf
        found[draw, : len(roots)] = roots[np.argsort(np.abs(roots), kind="stable")]
    return found.T


def minimum_phase(found: ComplexArray) -> FloatArray:
    """1 for each draw whose finite zeros all lie inside the unit circle, else 0, (draws,)."""
    return np.asarray(np.all((np.abs(found) < 1) | np.isinf(found), axis=0), dtype=np.float64)


def antiresonances(axis: AxisDraws, nominal: AxisDraws) -> tuple[Antiresonance, ...]:
    """Every lightly damped zero pair of `nominal` below half the sample rate, in order of frequency."""
    rate = axis.sample_rate_hz
    reference = zeros(nominal)[:, 0]
    everywhere = zeros(axis)
    found = []
    for zero in reference[np.isfinite(reference) & (reference.imag > 1e-9)]:
        s = np.log(zero) * rate
        if abs(s.real) > LIGHT_DAMPING * abs(s):
            continue
        nearest = np.argmin(np.abs(everywhere - zero), axis=0)
        matched = np.log(everywhere[nearest, np.arange(axis.count)]) * rate
        size = np.abs(matched)
        found.append(
            Antiresonance(
                float(abs(s)) / (2 * np.pi),
                float(-s.real / abs(s)),
                size / (2 * np.pi),
                -matched.real / size,
            )
        )
    return tuple(sorted(found, key=lambda pair: pair.nominal_hz))
