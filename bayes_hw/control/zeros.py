"""Zeros and antiresonances of G over the draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.control.axis_draws import AxisDraws

LIGHT_DAMPING = 0.3
"""A zero pair less damped than this makes a dip in the response."""


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
    """The zeros of every draw, (zeros, draws), as eigenvalues of the dynamics that hold w at zero.

    With A = diag(p), B = 1, C = r: those of A - B C / direct, or, without a direct term, those of
    (1 - B C / (C B)) A but for one at the origin (Kwakernaak and Sivan, Linear Optimal Control Systems,
    sec. 1.5.5). Zeros at infinity come out very large.
    """
    poles, residues = axis.poles.T, axis.residues.T
    n = poles.shape[1]
    a = np.zeros((axis.count, n, n), dtype=np.complex128)
    rows = np.arange(n)
    a[:, rows, rows] = poles
    if np.all(axis.direct != 0):
        found = np.linalg.eigvals(a - (residues / axis.direct[:, None])[:, None, :])
        return np.asarray(found.T, dtype=np.complex128)
    leading = residues.sum(axis=1)
    projected = a - (residues * poles / leading[:, None])[:, None, :]
    found = np.linalg.eigvals(projected)
    order = np.argsort(np.abs(found), axis=1)
    return np.asarray(np.take_along_axis(found, order, axis=1)[:, 1:].T, dtype=np.complex128)


def minimum_phase(found: ComplexArray) -> FloatArray:
    """1 for each draw whose zeros all lie inside the unit circle, else 0, (draws,)."""
    return np.asarray(np.all(np.abs(found) < 1, axis=0), dtype=np.float64)


def antiresonances(axis: AxisDraws, nominal: AxisDraws) -> tuple[Antiresonance, ...]:
    """Every lightly damped zero pair of `nominal` below half the sample rate, in order of frequency."""
    rate = axis.sample_rate_hz
    reference = zeros(nominal)[:, 0]
    everywhere = zeros(axis)
    found = []
    for zero in reference[reference.imag > 1e-9]:
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
