"""Residuals of a cascade and their derivatives, in the coordinates of a descent.

Coordinates, in this order: lower limit, upper limit and dead-zone half width, each where the structure has
it; the integrator's residue; pole coordinate and residue of every real pole; two reflection coordinates, b1
and b2 of every section; with `free_start` what every record holds before its first sample. Poles and
reflection coefficients are hyperbolic tangents of their coordinates (see `bayes_hw.identify.cascade`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import BoolArray, FloatArray
from bayes_hw.identify.cascade import MAX_REFLECTION, CascadeValues, Structure
from bayes_hw.identify.growth.levels import level_shapes
from bayes_hw.identify.growth.lowered import beyond, clipped, commands
from bayes_hw.identify.growth.sensitivity_kernel import (
    first_order,
    free_first_order,
    free_second_order,
    gate,
    integrate,
    respond,
    second_order,
)
from bayes_hw.identify.holes import masks_of, with_holes
from bayes_hw.record import Record

CLIPPED_SAMPLES = 1
"""That a limit clips at least: behind an integrator what it takes off a command stays in the angle."""

BLOCK_SAMPLES = 65_536
"""Samples that are linearised at a time: memory does not grow with a record."""


@dataclass(frozen=True, eq=False)
class CascadeResponse:
    """The residuals y - n(G f(u)) of `records` as a function of the coordinates of `structure`."""

    structure: Structure
    records: Sequence[Record]

    @cached_property
    def masks(self) -> tuple[BoolArray, ...] | None:
        """Which samples of every record were measured; None where all were."""
        return masks_of(self.records)

    @cached_property
    def level_shapes(self) -> tuple[FloatArray, ...]:
        """What a level of one adds to residuals; nothing where the start is free, which holds it."""
        shapes = level_shapes(self.records)
        return tuple(0 * shape for shape in shapes) if self.structure.free_start else shapes

    def coordinates(self, values: CascadeValues) -> FloatArray:
        """Coordinates (size,) of natural parameters."""
        s = self.structure
        parts: list[float] = []
        if s.lower:
            parts.append(values.lower)
        if s.upper:
            parts.append(values.upper)
        if s.dead_zone:
            parts.append(values.half_width)
        if s.integrator:
            parts.append(values.integrator_residue)
        for pole, residue in values.real.T:
            parts += [_inverse(pole), residue]
        for a1, a2, b1, b2 in values.sections.T:
            parts += [_inverse(a1 / (1 + a2)), _inverse(a2), b1, b2]
        found = np.array(parts, dtype=np.float64)
        return np.concatenate([found, values.starts.ravel()]) if s.free_start else found

    def values(self, coordinates: FloatArray) -> CascadeValues:
        """Natural parameters at `coordinates` (size,)."""
        s, rest = self.structure, list(coordinates[: self.structure.n_static + self.structure.n_linear])
        lower = rest.pop(0) if s.lower else -np.inf
        upper = rest.pop(0) if s.upper else np.inf
        half_width = rest.pop(0) if s.dead_zone else 0.0
        integrator = rest.pop(0) if s.integrator else 0.0
        n_real = 2 * s.real_poles
        real = np.array(rest[:n_real]).reshape(-1, 2).T.copy()
        real[0] = np.tanh(real[0])
        sections = np.array(rest[n_real:]).reshape(-1, 4).T.copy()
        k1, k2 = np.tanh(sections[0]), np.tanh(sections[1])
        sections[0], sections[1] = k1 * (1 + k2), k2
        starts = (
            coordinates[s.n_static + s.n_linear :].reshape(len(self.records), s.order)
            if s.free_start
            else np.zeros((len(self.records), s.order))
        )
        return CascadeValues(
            float(lower), float(upper), float(half_width), 0.0, float(integrator), real, sections, starts
        )

    def admissible(self, coordinates: FloatArray, previous: FloatArray) -> FloatArray:
        """The nearest coordinates that mean something: limits keep their sign and clip some samples (nothing
        would lead back from beyond all commands), a half width is not negative, reflection coordinates stay
        within what `MAX_REFLECTION` allows."""
        s, found, at = self.structure, coordinates.copy(), 0
        for present, outermost in zip((s.lower, s.upper), self.outermost_limits, strict=True):
            if present:
                if found[at] * previous[at] <= 0.04 * previous[at] ** 2:
                    found[at] = 0.2 * previous[at]
                if abs(found[at]) > abs(outermost):
                    found[at] = outermost
                at += 1
        if s.dead_zone:
            found[at] = max(found[at], 0.0)
        largest = _inverse(1.0)
        rows = self.pole_rows()
        found[rows] = np.clip(found[rows], -largest, largest)
        return found

    @cached_property
    def outermost_limits(self) -> tuple[float, float]:
        return outermost_limits(self.records)

    def pole_rows(self) -> list[int]:
        """Positions of pole and reflection coordinates."""
        s = self.structure
        begin = s.n_static + int(s.integrator)
        sections = begin + 2 * s.real_poles
        real = [begin + 2 * i for i in range(s.real_poles)]
        return real + [sections + 4 * i + j for i in range(s.sections) for j in (0, 1)]

    def residuals(self, coordinates: FloatArray) -> list[FloatArray]:
        """Measured less simulated output of every record, NaN where nothing was measured."""
        values = self.values(coordinates)
        found = []
        for number, record in enumerate(self.records):
            w = self.intermediate(values, number)
            found.append(with_holes(record.y - dead_zone(w, values.half_width), record.measured))
        return found

    def intermediate(self, values: CascadeValues, number: int) -> FloatArray:
        """w of record `number`, shape (samples,)."""
        v = clipped(self._delayed(number), values.lower, values.upper)
        w = np.empty(len(v))
        respond(v, values.integrator_residue, values.real, values.sections, self._starts(values, number), w)
        return w

    def linearise(
        self, coordinates: FloatArray, overlap: int
    ) -> Iterator[tuple[FloatArray, int, BoolArray | None]]:
        """Derivatives of y and, as the last row, the residual: rows (size + 1, samples), the number of
        samples at their start that belong to the block before, `overlap` of them or as many as it takes for
        the first `overlap` to have been measured, and which samples were, None where all."""
        values = self.values(coordinates)
        for number, record in enumerate(self.records):
            states = _States.of(self.structure, self._starts(values, number))
            command, before = self._delayed(number), np.empty((0, 0))
            for begin in range(0, len(record), BLOCK_SAMPLES):
                part = slice(begin, begin + BLOCK_SAMPLES)
                rows = self._block(values, number, command[part], record.y[part], states)
                kept = _overlap(record.measured, begin, overlap)
                joined = np.concatenate([before[:, -kept:], rows], axis=1) if kept else rows
                before = rows
                measured = None if record.measured is None else record.measured[begin - kept : part.stop]
                yield joined, kept, measured

    def gated(self, coordinates: FloatArray) -> list[tuple[FloatArray, BoolArray]]:
        """For every record the clipped, delayed command and where the output leaves the dead zone."""
        values = self.values(coordinates)
        found = []
        for number in range(len(self.records)):
            v = clipped(self._delayed(number), values.lower, values.upper)
            found.append((v, np.abs(self.intermediate(values, number)) > values.half_width))
        return found

    def _delayed(self, number: int) -> FloatArray:
        u, delay = commands(self.records[number]), self.structure.delay_samples
        delayed = np.full(u.shape, u.flat[0] if self.structure.free_start else 0.0)
        if delay < len(u):
            delayed[delay:] = u[: len(u) - delay]
        return delayed

    def _starts(self, values: CascadeValues, number: int) -> FloatArray:
        """What a record begins with, nothing where it begins at rest."""
        return np.ascontiguousarray(values.starts[number]) if self.structure.free_start else np.zeros(0)

    def _block(
        self,
        values: CascadeValues,
        number: int,
        u: FloatArray,
        y: FloatArray,
        states: _States,
    ) -> FloatArray:
        s = self.structure
        size, samples = s.size(len(self.records)), len(u)
        rows = np.zeros((size + 1, samples))
        w, below_limit, above_limit = np.zeros(samples), np.zeros(samples), np.zeros(samples)
        v = clipped(u, values.lower, values.upper)
        below, above = beyond(u, values.lower, values.upper)
        at, to_start = s.n_static, s.n_static + s.n_linear + number * s.order
        if s.integrator:
            integrate(
                v, below, above, values.integrator_residue, states.integral, w, below_limit, above_limit,
                rows[at],
            )  # fmt: skip
            at += 1
            if s.free_start:
                rows[to_start] = 1.0
                to_start += 1
        for i in range(s.real_poles):
            pole, residue = values.real[:, i]
            first_order(
                v, below, above, pole, residue, 1 - pole**2, states.real[i], w, below_limit, above_limit,
                rows[at], rows[at + 1],
            )  # fmt: skip
            if s.free_start:
                start = values.starts[number, int(s.integrator) + i]
                free_first_order(pole, start, 1 - pole**2, states.free_real[i], w, rows[at], rows[to_start])
                to_start += 1
            at += 2
        for i in range(s.sections):
            a1, a2 = values.sections[:2, i]
            k1 = a1 / (1 + a2)
            slopes = np.array([(1 - k1**2) * (1 + a2), k1 * (1 - a2**2), 1 - a2**2])
            section = np.ascontiguousarray(values.sections[:, i])
            second_order(
                v, below, above, section, slopes, states.sections[i], w, below_limit, above_limit,
                *rows[at : at + 4],
            )  # fmt: skip
            if s.free_start:
                first = int(s.integrator) + s.real_poles + 2 * i
                free_second_order(
                    section, slopes, values.starts[number, first : first + 2], states.free_sections[i], w,
                    rows[at], rows[at + 1], rows[to_start], rows[to_start + 1],
                )  # fmt: skip
                to_start += 2
            at += 4
        at = 0
        for present, row in ((s.lower, below_limit), (s.upper, above_limit)):
            if present:
                rows[at] = row
                at += 1
        if s.dead_zone:
            rows[at] = -np.sign(w)
        gate(w, values.half_width, rows[:-1])
        rows[-1] = y - dead_zone(w, values.half_width)
        return rows


@dataclass(frozen=True, eq=False)
class _States:
    """What the parts of a cascade hold at the next sample of a record, see `sensitivity_kernel`."""

    integral: FloatArray
    real: FloatArray
    sections: FloatArray
    free_real: FloatArray
    free_sections: FloatArray

    @classmethod
    def of(cls, structure: Structure, starts: FloatArray) -> _States:
        """Before the first sample of a record that begins with `starts`."""
        integral = np.zeros(4)
        integral[3] = starts[:1].sum() if structure.integrator else 0.0
        free_real, free_sections = np.zeros((structure.real_poles, 2)), np.zeros((structure.sections, 8))
        free_real[:, 0] = 1.0
        free_sections[:, [0, 1, 3]] = 1.0
        return cls(
            integral,
            np.zeros((structure.real_poles, 4)),
            np.zeros((structure.sections, 8)),
            free_real,
            free_sections,
        )


def _overlap(measured: BoolArray | None, begin: int, overlap: int) -> int:
    """Samples before `begin` of which the first `overlap` were measured, or the whole block before."""
    kept = min(overlap, begin)
    if measured is None or not kept:
        return kept
    longest = min(begin, BLOCK_SAMPLES)
    while kept < longest and not measured[begin - kept : begin - kept + overlap].all():
        kept += 1
    return kept


def dead_zone(w: FloatArray, half_width: float) -> FloatArray:
    """y of w (eq. 4 of the paper with unit gains): what exceeds the half width, with its sign."""
    return np.sign(w) * np.maximum(np.abs(w) - half_width, 0.0)


def _inverse(value: float) -> float:
    return float(np.arctanh(np.clip(value, -MAX_REFLECTION, MAX_REFLECTION)))


def outermost_limits(records: Sequence[Record]) -> tuple[float, float]:
    """Lower and upper limit that clip as few samples as a descent allows."""
    commands = np.sort(np.concatenate([record.u for record in records]))
    return min(float(commands[CLIPPED_SAMPLES]), 0.0), max(float(commands[-1 - CLIPPED_SAMPLES]), 0.0)
