"""What no experiment can tell: the exactly flat directions of the model with its gains set free.

At many points of the parameter space the outputs of a command that visits every regime (both limits, both
sides of the dead zone, its inside) are differentiated. The null space of that sensitivity matrix is compared
with the tangent plane of the scaling group, and finite steps along the group with rounding.

Poles and zeros that nearly cancel: the records see little of either.

Leaving out a group of poles P and as many zeros Z divides G by

    r(zeta) = prod_Z (zeta - z) / prod_P (zeta - p)

at the point zeta = exp(2 pi i f / rate). The group nearly cancels where |r - 1| is small at every frequency.
A group is closed under conjugation: one real root, a conjugate pair, or two real roots.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, TypeAlias

import numpy as np
from scipy import linalg

from bayes_hw.arrays import ComplexArray, FloatArray, IntArray
from bayes_hw.errors import InputError
from bayes_hw.identifiability.freed_gains import (
    ALL_FREED,
    GAIN_NEGATIVE,
    GAIN_POSITIVE,
    HALF_WIDTH_NEGATIVE,
    HALF_WIDTH_POSITIVE,
    SLOPE,
    FreedGains,
)
from bayes_hw.identifiability.scaling_group import acting_generators, exponent_vector
from bayes_hw.identifiability.sensitivity import sensitivity
from bayes_hw.identify.output_error import simulated_outputs
from bayes_hw.model.hammerstein_wiener import HammersteinWiener
from bayes_hw.model.kernel import simulate_batch
from bayes_hw.model.parameters import as_coordinates, as_values
from bayes_hw.record import Record

FLAT_BELOW = 1e-6
"""A singular value below this share of the largest is flat."""

SMALLEST_GAP = 100.0
"""The smallest singular value that is not flat must exceed the largest flat one by this factor."""

LARGEST_KINK = 1e-3
"""Points where differences to either side disagree by more than this share are drawn again."""

POINTS = 100
SPREAD = 0.3
"""Standard deviation, in logarithms, of the points about the model; a tenth of it for frequencies."""

LEVELS = 48
SHORTEST_HOLD = 6
REACH_SHARE = 0.1
"""The dead zone analysed is this share of the reach of w, so that every command of length shows it."""

LEAST_SHARE = 0.01
"""Every regime must hold at least this share of the samples."""

MOST_REDRAWN = 20

SETTINGS: tuple[tuple[str, Mapping[str, float]], ...] = (
    ("c1 = 1", {SLOPE: 1.0}),
    ("c2 = 1", {GAIN_POSITIVE: 1.0}),
    ("c3 = c2", {GAIN_NEGATIVE: 1.0, GAIN_POSITIVE: -1.0}),
    ("delta- = delta+", {HALF_WIDTH_NEGATIVE: 1.0, HALF_WIDTH_POSITIVE: -1.0}),
)
"""The paper's settings, each as the logarithm of a monomial that it puts to zero."""


@dataclass(frozen=True)
class Setting:
    """One of the paper's settings, and the rank of what the data can see without it and with it.

    A setting that lowers the rank by nothing is a normalization; one that lowers it takes away a direction
    that changes the output: an assumption.
    """

    name: str
    rank_before: int
    rank_after: int

    @property
    def normalization(self) -> bool:
        return self.rank_before == self.rank_after


@dataclass(frozen=True, eq=False)
class Structure:
    """Null spaces of the sensitivity at many points.

    `flat` (points,) says how many directions are flat;
    `gap` (points,) the ratio of the smallest that is not flat to the largest that is; `angle` (points,) the
    largest principal angle (rad) between the null space and the tangent plane of the scaling group, whose
    dimension is `expected`; `orbit_error` (points,) the largest change of the output along a finite step of
    the group, as a share of the largest output; `flat_share` (parameters,) the length of each parameter's
    direction within the null space, the largest over the points. `redrawn` points lacked a regime or had a
    sample at a kink.
    """

    names: tuple[str, ...]
    flat: IntArray
    gap: FloatArray
    angle: FloatArray
    orbit_error: FloatArray
    flat_share: FloatArray
    settings: tuple[Setting, ...]
    expected: int
    redrawn: int

    @property
    def agrees(self) -> bool:
        """Whether every point has as many flat directions as the group has dimensions, behind a clear gap."""
        return bool(np.all(self.flat == self.expected) and np.all(self.gap >= SMALLEST_GAP))

    def to_dict(self) -> dict[str, Any]:
        """Plain data of identifiability.json."""
        return {
            "points": len(self.flat),
            "parameters": list(self.names),
            "flat_directions": sorted({int(count) for count in self.flat}),
            "group_dimension": self.expected,
            "flat_below": FLAT_BELOW,
            "smallest_gap": float(self.gap.min()) if self.expected else None,
            "largest_angle_rad": float(self.angle.max()),
            "largest_orbit_error": float(self.orbit_error.max()),
            "flat_share": dict(zip(self.names, self.flat_share.tolist(), strict=True)),
            "settings": [
                {
                    "setting": setting.name,
                    "rank_without": setting.rank_before,
                    "rank_with": setting.rank_after,
                    "kind": "normalization" if setting.normalization else "assumption",
                }
                for setting in self.settings
            ],
        }


def analyse_structure(
    model: HammersteinWiener,
    rng: np.random.Generator,
    *,
    freed: Sequence[str] = ALL_FREED,
    points: int = POINTS,
) -> Structure:
    """Flat directions of `model` with the gains `freed`, at random points about it.

    Raises InputError when no point shows every regime.
    """
    u = rich_command(model, rng)
    reach = float(np.max(np.abs(model.simulate(u).w)))
    wide = replace(model, dead_zone=replace(model.dead_zone, half_width=REACH_SHARE * reach))
    axis = FreedGains(wide, freed)
    record = Record(
        "rich command", np.arange(len(u)) / model.sample_rate_hz, u, u, model.sample_rate_hz, model.units
    )
    group = acting_generators(axis.names)
    rows: list[tuple[int, float, float, float]] = []
    share = np.zeros(len(axis.names))
    ranks = np.zeros(len(SETTINGS) + 1, dtype=np.int64)
    redrawn = 0
    while len(rows) < points:
        values = _random_point(axis, rng)
        found = sensitivity(axis, values, [record]) if _shows_every_regime(axis, values, u) else None
        if found is None or found.kink > LARGEST_KINK:
            redrawn += 1
            if redrawn > MOST_REDRAWN * points:
                raise InputError(
                    f"{model.name}: no parameters near it show every regime; check its gain and units"
                )
            continue
        _, singular, directions = np.linalg.svd(found.matrix, full_matrices=False)
        relative = singular / singular[0]
        flat = int(np.count_nonzero(relative < FLAT_BELOW))
        null = directions[len(relative) - flat :].T
        rows.append(
            (
                flat,
                _gap(relative, flat),
                _largest_angle(null, group),
                _orbit_error(axis, values, record, group @ rng.standard_normal(group.shape[1])),
            )
        )
        share = np.maximum(share, np.linalg.norm(null, axis=1))
        ranks = np.maximum(ranks, _ranks(found.matrix, axis.names))
    flats, gaps, angles, errors = (np.array(column) for column in zip(*rows, strict=True))
    settings = tuple(
        Setting(name, int(before), int(after))
        for (name, _), before, after in zip(SETTINGS, ranks[:-1], ranks[1:], strict=True)
    )
    return Structure(axis.names, flats, gaps, angles, errors, share, settings, group.shape[1], redrawn)


def rich_command(model: HammersteinWiener, rng: np.random.Generator) -> FloatArray:
    """Steps of random height up to half beyond either limit, then mirrored, shape (samples,).

    Each is held for a quarter of the slowest dominant mode's period.
    """
    slope = model.normalization.c1
    levels = rng.uniform(1.5 * model.saturation.lower / slope, 1.5 * model.saturation.upper / slope, LEVELS)
    frequencies = [mode.frequency_hz for mode in model.dominant_modes]
    hold = SHORTEST_HOLD
    if frequencies:
        hold = max(hold, round(model.sample_rate_hz / (4 * min(frequencies))))
    return np.repeat(np.concatenate([levels, -levels, -levels, levels]), hold)


def _random_point(axis: FreedGains, rng: np.random.Generator) -> FloatArray:
    """Values (parameters,) about the nominal ones, with the modes in order."""
    spread = np.array([0.1 * SPREAD if name.endswith("_hz") else SPREAD for name in axis.names])
    centre = as_coordinates(axis.parameters, axis.nominal)
    while True:
        values = as_values(axis.parameters, centre + spread * rng.standard_normal(len(centre)))
        if axis.in_order(values[:, None])[0]:
            return values


def _shows_every_regime(axis: FreedGains, values: FloatArray, u: FloatArray) -> bool:
    form = axis.modal_form(values[:, None])
    w, y = simulate_batch(form, u, axis.model.linear.delay_samples)
    lower, upper, c1 = form.static[:3, 0]
    regimes = (c1 * u < lower, c1 * u > upper, y[0] > 0, y[0] < 0, y[0] == 0)
    return bool(np.isfinite(w).all() and min(float(np.mean(regime)) for regime in regimes) >= LEAST_SHARE)


def _gap(relative: FloatArray, flat: int) -> float:
    """Smallest singular value that is not flat over the largest that is; infinite where none is flat."""
    if flat == 0:
        return np.inf
    if flat == len(relative):
        return 0.0
    return float(relative[-flat - 1]) / max(float(relative[-flat]), np.finfo(np.float64).tiny)


def _largest_angle(null: FloatArray, group: FloatArray) -> float:
    """Largest principal angle (rad) of two subspaces; a right angle where their dimensions differ."""
    if null.shape[1] != group.shape[1]:
        return np.pi / 2
    return float(np.max(linalg.subspace_angles(null, group))) if group.shape[1] else 0.0


def _orbit_error(axis: FreedGains, values: FloatArray, record: Record, step: FloatArray) -> float:
    """Largest change of the output when the logarithms of the parameters move by `step` (parameters,)."""
    both = np.stack([values, values * np.exp(step)], axis=1)
    before, after = simulated_outputs(axis, both, [record])[0]
    return float(np.max(np.abs(after - before)) / np.max(np.abs(before)))


def _ranks(matrix: FloatArray, names: Sequence[str]) -> IntArray:
    """Rank of the sensitivity with none, one, two, ... of SETTINGS in force, shape (settings + 1,)."""
    found = [_rank(matrix)]
    for count in range(1, len(SETTINGS) + 1):
        rows = np.stack([exponent_vector(exponents, names) for _, exponents in SETTINGS[:count]])
        rows = rows[np.any(rows != 0, axis=1)]
        found.append(_rank(matrix @ linalg.null_space(rows)) if len(rows) else found[0])
    return np.array(found, dtype=np.int64)


def _rank(matrix: FloatArray) -> int:
    singular = np.linalg.svd(matrix, compute_uv=False)
    return int(np.count_nonzero(singular >= FLAT_BELOW * singular[0]))


NEARLY = 0.2
"""Poles and zeros nearly cancel when leaving them out changes G by less than this share everywhere."""

FREQUENCIES = 1024

Group: TypeAlias = tuple[complex, ...]


@dataclass(frozen=True)
class Cancellation:
    """Poles and zeros of G whose common removal changes it by at most the share `change`.

    `frequency_hz` is that of the first pole's angle, zero for real poles.
    """

    poles: Group
    zeros: Group
    change: float
    frequency_hz: float

    def to_dict(self) -> dict[str, Any]:
        """Plain data of identifiability.json."""
        return {
            "poles": [[root.real, root.imag] for root in self.poles],
            "zeros": [[root.real, root.imag] for root in self.zeros],
            "largest_change": self.change,
            "frequency_hz": self.frequency_hz,
        }


def near_cancellations(model: HammersteinWiener) -> tuple[Cancellation, ...]:
    """Groups of poles and zeros, each root used once, whose removal changes G by less than NEARLY."""
    candidates = []
    for poles in _groups(model.linear.poles):
        for zeros in _groups(model.linear.zeros):
            if len(poles) == len(zeros):
                change = largest_change(np.array(poles), np.array(zeros))
                if change < NEARLY:
                    candidates.append((len(poles), change, poles, zeros))
    found: list[Cancellation] = []
    used: set[tuple[str, complex]] = set()
    for _, change, poles, zeros in sorted(candidates, key=lambda each: each[:2]):
        roots = {*(("pole", root) for root in poles), *(("zero", root) for root in zeros)}
        if not roots & used:
            used |= roots
            frequency = abs(float(np.angle(poles[0]))) / (2 * np.pi) * model.sample_rate_hz
            found.append(Cancellation(poles, zeros, change, frequency))
    return tuple(found)


def largest_change(poles: ComplexArray, zeros: ComplexArray) -> float:
    """Largest |r - 1| over the frequencies; infinite for a pole on the unit circle."""
    if np.any(np.abs(poles) >= 1):
        return float("inf")
    angles: FloatArray = np.concatenate([np.linspace(0, np.pi, FREQUENCIES), np.abs(np.angle(poles))])
    zeta = np.exp(1j * angles)[:, None]
    ratio = np.prod(zeta - zeros, axis=1) / np.prod(zeta - poles, axis=1)
    return float(np.max(np.abs(ratio - 1)))


def _groups(roots: ComplexArray) -> Sequence[Group]:
    """Every real root, every conjugate pair, every two real roots."""
    real = [complex(root) for root in roots if root.imag == 0]
    pairs = [(complex(root), complex(root.conjugate())) for root in roots if root.imag > 0]
    return [*((root,) for root in real), *pairs, *combinations(real, 2)]
