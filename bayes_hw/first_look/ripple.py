"""Errors periodic in the angle: cogging, gear mesh, the encoder's eccentricity and interpolation.

Trial periods are those whose amplitude stands out from its neighbours. Each is tried on visits: one passage
through one period, whose level and slope are taken out. Sine and cosine of the visits have a mean clear of
zero by Hotelling's test, at a level shared among all trials; and so have their means by place, since an error
of the command's may return to one place with every stroke.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import special

from bayes_hw.arrays import ComplexArray, FloatArray, IntArray

MOST_SAMPLES = 12_000
RATE_HZ = 25.0
LEAST_PERIODS, MOST_PERIODS = 3.0, 500.0
"""Periods within the range of the angles."""

A_PERIOD = 2.0
"""Trial frequencies to the width of a line."""

SAMPLES_A_PERIOD = 8.0
CANDIDATES, MOST_RIPPLES = 6, 3
FEWEST_VISITS, FEWEST_PLACES = 6, 4
WHOLE = 0.85
"""Of a period, that a visit has passed to count."""

LEVEL, PLACE_LEVEL = 1e-4, 0.01
NEIGHBOURS = 25
SMALLEST = 0.1
"""Of the first ripple's amplitude: smaller ones may be what it left."""


@dataclass(frozen=True)
class Ripple:
    """An error of this amplitude and period, output units; over how many passages of a period."""

    period: float
    amplitude: float
    visits: int


@dataclass(frozen=True, eq=False)
class _Slow:
    """A record averaged down, and where it begins among all: angle, speed (of unit size), error."""

    angle: FloatArray
    speed: FloatArray
    error: FloatArray


def ripples(
    angles: Sequence[FloatArray], errors: Sequence[FloatArray], sample_rate_hz: float
) -> tuple[tuple[Ripple, ...], tuple[FloatArray, ...]]:
    """The ripples, the largest first, and the part of every error that they make up, (samples,) a record.

    That part may shift in phase and change in size with the speed, as what a loop holds against does.
    """
    found: list[Ripple] = []
    explained = [np.zeros(len(error)) for error in errors]
    for _ in range(MOST_RIPPLES):
        left = [error - part for error, part in zip(errors, explained, strict=True)]
        slow, size = _slow(angles, left, sample_rate_hz)
        best = _clearest(slow, [1 / ripple.period for ripple in found])
        if best is None:
            break
        frequency, visits = best
        coefficients = _fitted(slow, frequency)
        amplitude = _explained(slow, frequency)
        if found and amplitude < SMALLEST * found[0].amplitude:
            break
        found.append(Ripple(1 / frequency, amplitude, visits))
        for k, angle in enumerate(angles):
            explained[k] += _waves(angle, _speed(angle, sample_rate_hz) / size, frequency) @ coefficients
    return tuple(found), tuple(explained)


def _slow(
    angles: Sequence[FloatArray], errors: Sequence[FloatArray], sample_rate_hz: float
) -> tuple[list[_Slow], float]:
    """Records at about RATE_HZ or less, and the largest speed."""
    total = sum(map(len, angles))
    factor = max(1, round(sample_rate_hz / RATE_HZ), -(-total // MOST_SAMPLES))
    speeds = [_speed(angle, sample_rate_hz) for angle in angles]
    size = max((float(np.abs(speed).max()) for speed in speeds), default=0.0) or 1.0

    def averaged(values: FloatArray) -> FloatArray:
        return np.asarray(values[: len(values) // factor * factor].reshape(-1, factor).mean(axis=1))

    return [
        _Slow(averaged(angle), averaged(speed) / size, averaged(error))
        for angle, speed, error in zip(angles, speeds, errors, strict=True)
        if len(angle) >= 8 * factor
    ], size


def _speed(angle: FloatArray, sample_rate_hz: float) -> FloatArray:
    """Slope over about a fifth of a second, shape (samples,)."""
    width = max(1, round(0.1 * sample_rate_hz))
    padded = np.pad(angle, width, mode="edge")
    return (padded[2 * width :] - padded[: -2 * width]) * sample_rate_hz / (2 * width)


def _clearest(slow: Sequence[_Slow], known: Sequence[float]) -> tuple[float, int] | None:
    """The frequency, periods a unit of angle, of the clearest ripple but those `known`, and its visits; None
    for none."""
    if not slow:
        return None
    angle = np.concatenate([one.angle for one in slow])
    error = np.concatenate([one.error - one.error.mean() for one in slow])
    extent = float(np.ptp(angle))
    moving = np.concatenate([np.abs(np.diff(one.angle)) for one in slow])
    step = float(np.quantile(moving, 0.5))
    if not (extent > 0 and step > 0 and float(np.ptp(error)) > 0):
        return None
    most = min(MOST_PERIODS, extent / (SAMPLES_A_PERIOD * step))
    if most <= LEAST_PERIODS:
        return None
    count = int(A_PERIOD * (most - LEAST_PERIODS)) + 2
    frequencies = np.linspace(LEAST_PERIODS, most, count) / extent
    power = np.array([abs(np.exp(2j * np.pi * f * angle) @ error) ** 2 for f in frequencies])
    around = [float(np.median(power[max(k - NEIGHBOURS, 0) : k + NEIGHBOURS + 1])) for k in range(len(power))]
    order = np.argsort(power / np.maximum(around, 1e-300))[::-1][:CANDIDATES]
    clear = []
    for at in order.tolist():
        frequency = _refined(angle, error, float(frequencies[at]), 1 / (A_PERIOD * extent))
        visits = _visits(slow, frequency)
        if visits is None or any(abs(frequency - one) < 2 / extent for one in known):
            continue
        values, place = visits
        if _probability(values) * count < LEVEL and _probability(_by_place(values, place)) < PLACE_LEVEL:
            clear.append((_explained(slow, frequency), frequency, len(values)))
    if not clear:
        return None
    _, frequency, number = max(clear)
    return frequency, number


def _refined(angle: FloatArray, error: FloatArray, frequency: float, width: float) -> float:
    """The frequency of largest amplitude within `width` of the trial."""
    for half in (width, width / 4):
        trials = frequency + np.linspace(-half, half, 9)
        frequency = float(max(trials, key=lambda f: abs(np.exp(2j * np.pi * f * angle) @ error)))
    return frequency


def _visits(slow: Sequence[_Slow], frequency: float) -> tuple[ComplexArray, IntArray] | None:
    """Amplitude of every whole passage of a period, (visits,), and which period it passed."""
    values: list[complex] = []
    places: list[int] = []
    for one in slow:
        phase = one.angle * frequency
        cell = np.floor(phase).astype(np.int64)
        edges = np.flatnonzero(np.diff(cell, prepend=cell[0] - 1, append=cell[-1] + 1))
        for start, stop in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            inside = phase[start:stop]
            if stop - start < 6 or float(np.ptp(inside)) < WHOLE:
                continue
            turn = 2 * np.pi * inside
            table = np.column_stack([np.ones(len(turn)), inside - inside.mean(), np.cos(turn), np.sin(turn)])
            fitted = np.linalg.lstsq(table, one.error[start:stop], rcond=1e-10)[0]
            values.append(complex(fitted[2], fitted[3]))
            places.append(int(cell[start]))
    if len(values) < FEWEST_VISITS or len(set(places)) < FEWEST_PLACES:
        return None
    return np.array(values), np.array(places, dtype=np.int64)


def _by_place(values: ComplexArray, place: IntArray) -> ComplexArray:
    _, at = np.unique(place, return_inverse=True)
    count = np.bincount(at)
    sums: ComplexArray = np.bincount(at, values.real) + 1j * np.bincount(at, values.imag)
    return np.asarray(sums / count, dtype=np.complex128)


def _probability(values: ComplexArray) -> float:
    """That amplitudes without a mean give such a mean: Hotelling's test in the plane."""
    number = len(values)
    plane = np.column_stack([values.real, values.imag])
    covariance = np.cov(plane.T)
    mean = plane.mean(axis=0)
    determinant = float(np.linalg.det(covariance))
    if not determinant > 0:
        return 1.0
    square = number * float(mean @ np.linalg.solve(covariance, mean))
    ratio = (number - 2) / (2 * (number - 1)) * square
    return float(special.fdtrc(2, number - 2, ratio))


def _waves(angle: FloatArray, speed: FloatArray, frequency: float) -> FloatArray:
    """Cosine and sine, and both times the speed, (samples, 4)."""
    turn = 2 * np.pi * frequency * angle
    return np.column_stack([np.cos(turn), np.sin(turn), speed * np.cos(turn), speed * np.sin(turn)])


def _fitted(slow: Sequence[_Slow], frequency: float) -> FloatArray:
    """Coefficients of the four waves beside level and slope of every record."""
    tables, targets = [], []
    for one in slow:
        basis = np.column_stack([np.ones(len(one.angle)), np.linspace(-1, 1, len(one.angle))])
        both = np.column_stack([_waves(one.angle, one.speed, frequency), one.error])
        both -= basis @ np.linalg.lstsq(basis, both, rcond=None)[0]
        tables.append(both[:, :4])
        targets.append(both[:, 4])
    return np.asarray(np.linalg.lstsq(np.concatenate(tables), np.concatenate(targets), rcond=1e-10)[0])


def _explained(slow: Sequence[_Slow], frequency: float) -> float:
    """Amplitude of cosine and sine alone."""
    turn = 2 * np.pi * frequency * np.concatenate([one.angle for one in slow])
    error = np.concatenate([one.error - one.error.mean() for one in slow])
    table = np.column_stack([np.cos(turn), np.sin(turn)])
    return float(np.hypot(*np.linalg.lstsq(table - table.mean(axis=0), error, rcond=None)[0]))
