"""The scaling group of the gains, and what it leaves alone.

v -> a v and w -> b w, with a, b > 0, change no output y when the gains change with them:

    c1, lower, upper -> a times themselves,   g -> (b / a) g,
    delta_plus, delta_minus -> b times themselves,   c2, c3 -> themselves / b

A group of dimension two: in the logarithms of the parameters its orbits are parallel planes. A monomial of
the parameters whose exponents are orthogonal to both generators is an invariant.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.identifiability.freed_gains import (
    GAIN,
    GAIN_NEGATIVE,
    GAIN_POSITIVE,
    HALF_WIDTH_NEGATIVE,
    HALF_WIDTH_POSITIVE,
    LOWER,
    SLOPE,
    UPPER,
)
from bayes_hw.record import Units

Exponents = Mapping[str, float]

GENERATORS: tuple[Exponents, Exponents] = (
    {SLOPE: 1.0, LOWER: 1.0, UPPER: 1.0, GAIN: -1.0},
    {GAIN: 1.0, HALF_WIDTH_POSITIVE: 1.0, HALF_WIDTH_NEGATIVE: 1.0, GAIN_POSITIVE: -1.0, GAIN_NEGATIVE: -1.0},
)
"""Exponents of v -> a v and of w -> b w."""


@dataclass(frozen=True)
class Invariant:
    """A monomial of the parameters that no rescaling of v and w changes."""

    name: str
    exponents: Exponents
    unit: str


def invariants(units: Units) -> tuple[Invariant, ...]:
    """A complete set: what input and output can tell of the gains, limits and thresholds.

    In words: the limits in command units, the gain from command to output above the dead zone, both
    thresholds in output units, and the two ratios that the paper sets to one.
    """
    return (
        Invariant("lower/c1", {LOWER: 1.0, SLOPE: -1.0}, units.input),
        Invariant("upper/c1", {UPPER: 1.0, SLOPE: -1.0}, units.input),
        Invariant("c1 g c2", {SLOPE: 1.0, GAIN: 1.0, GAIN_POSITIVE: 1.0}, ""),
        Invariant("c2 delta+", {GAIN_POSITIVE: 1.0, HALF_WIDTH_POSITIVE: 1.0}, units.output),
        Invariant("c3 delta-", {GAIN_NEGATIVE: 1.0, HALF_WIDTH_NEGATIVE: 1.0}, units.output),
        Invariant("c3/c2", {GAIN_NEGATIVE: 1.0, GAIN_POSITIVE: -1.0}, ""),
        Invariant("delta+/delta-", {HALF_WIDTH_POSITIVE: 1.0, HALF_WIDTH_NEGATIVE: -1.0}, ""),
    )


def exponent_vector(exponents: Exponents, names: Sequence[str]) -> FloatArray:
    """The exponents of the parameters `names`, shape (parameters,); those not named are zero."""
    return np.array([exponents.get(name, 0.0) for name in names])


def generators(names: Sequence[str]) -> FloatArray:
    """The two tangent directions of the group in log coordinates of `names`, shape (parameters, 2)."""
    return np.stack([exponent_vector(generator, names) for generator in GENERATORS], axis=1)


def acting_generators(names: Sequence[str]) -> FloatArray:
    """Tangent directions that stay when only `names` are free, shape (parameters, 0, 1 or 2).

    Those combinations of the generators that move no parameter which is held; a negative threshold that is
    not free follows the positive one.
    """
    moving = {name for generator in GENERATORS for name in generator} - {HALF_WIDTH_NEGATIVE}
    held = sorted(moving - set(names))
    moved = np.stack([exponent_vector(generator, held) for generator in GENERATORS], axis=1)
    _, values, rows = np.linalg.svd(moved, full_matrices=True) if held else (None, np.zeros(0), np.eye(2))
    rank = int(np.count_nonzero(values > 1e-12))
    return generators(names) @ rows[rank:].T


def monomial(exponents: Exponents, values: FloatArray, names: Sequence[str]) -> FloatArray:
    """The monomial at values (..., parameters), with the sign of its factors, shape (...)."""
    powers = exponent_vector(exponents, names)
    used = np.flatnonzero(powers)
    sign = np.prod(np.sign(values[..., used]) ** np.abs(powers[used]), axis=-1)
    return np.asarray(sign * np.exp(np.log(np.abs(values[..., used])) @ powers[used]))


def log_monomial(exponents: Exponents, values: FloatArray, names: Sequence[str]) -> FloatArray:
    """log of the monomial's magnitude at values (..., parameters), shape (...)."""
    powers = exponent_vector(exponents, names)
    used = np.flatnonzero(powers)
    return np.asarray(np.log(np.abs(values[..., used])) @ powers[used])
