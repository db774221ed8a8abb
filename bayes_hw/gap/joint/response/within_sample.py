"""G stepped several times a sample, as laws inside the sample ask for: what every pole and weight becomes.

A step is an n-th of a sample, over which command and torque are held: x' = A x + B v of a sample becomes
x' = f(A) x + (f(A) - I) (A - I)^-1 B v with f the n-th root, which gives the same response to a command that
is held over the sample. A pole that no continuous system has (zero or negative) has no such root; it becomes
a fast one that settles within the sample.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import ComplexArray, FloatArray
from bayes_hw.gap.joint.response.kernel_numbers import PathColumns, Paths

LEAST_POLE = 0.05
"""Below it a real pole is taken for one that settles within the sample."""

DIFFERENCE = 1e-6
"""Of a pole's coefficients, for derivatives; root n of poles is smooth on a scale of LEAST_POLE."""

APART = 1e-7
"""Poles of one section nearer than that are put as far apart."""


def root_of(pole: ComplexArray, steps: int) -> ComplexArray:
    """The n-th root of poles (shape of `pole`), its logarithm continued by its slope below LEAST_POLE."""
    real = np.abs(pole.imag) == 0
    low = real & (pole.real < LEAST_POLE)
    safe = np.where(low, LEAST_POLE, pole)
    logarithm = np.log(safe) + np.where(low, (pole.real - LEAST_POLE) / LEAST_POLE, 0.0)
    return np.asarray(np.exp(logarithm / steps), dtype=np.complex128)


@dataclass(frozen=True, eq=False)
class FastPoles:
    """Real poles (n,) of a sample as those of a step, their weights times `weight`, with the derivatives of
    both by the pole."""

    poles: FloatArray
    steps: int

    @cached_property
    def pole(self) -> FloatArray:
        return np.asarray(root_of(self.poles.astype(np.complex128), self.steps).real)

    @cached_property
    def weight(self) -> FloatArray:
        return np.asarray((1 - self.pole) / (1 - self.poles))

    @cached_property
    def pole_slope(self) -> FloatArray:
        return self.pole / (self.steps * np.maximum(self.poles, LEAST_POLE))

    @cached_property
    def weight_slope(self) -> FloatArray:
        return np.asarray((self.weight - self.pole_slope) / (1 - self.poles))


@dataclass(frozen=True, eq=False)
class FastSections:
    """Coefficients a1, a2 (n,) of sections in transposed form as those of a step.

    `enter` (n, 2, 2) turns weights into the states, `seen` (n, 2, 2) weights of the states in a signal: row
    vectors from the right.
    """

    a1: FloatArray
    a2: FloatArray
    steps: int

    @cached_property
    def _of_matrix(self) -> tuple[FloatArray, FloatArray]:
        """c0, c1 of f(A) = c0 I + c1 A."""
        middle = self.a1.astype(np.complex128) / 2
        apart = np.sqrt(middle**2 - self.a2)
        apart = np.where(np.abs(apart) < APART, APART, apart)
        one, two = root_of(middle + apart, self.steps), root_of(middle - apart, self.steps)
        c1 = (one - two) / (2 * apart)
        return np.asarray((one - c1 * (middle + apart)).real), np.asarray(c1.real)

    @cached_property
    def coefficients(self) -> tuple[FloatArray, FloatArray]:
        """a1 and a2 of a step."""
        c0, c1 = self._of_matrix
        return 2 * c0 + c1 * self.a1, c0**2 + c0 * c1 * self.a1 + c1**2 * self.a2

    @cached_property
    def _into(self) -> FloatArray:
        c0, c1 = self._of_matrix
        found = np.zeros((len(c0), 2, 2))
        found[:, 0, 0] = 1.0
        found[:, 1, 0], found[:, 1, 1] = -c0, c1
        return found

    @cached_property
    def enter(self) -> FloatArray:
        c0, c1 = self._of_matrix
        matrix = np.zeros((len(c0), 2, 2))
        matrix[:, 0, 0], matrix[:, 0, 1], matrix[:, 1, 0] = self.a1, 1.0, -self.a2
        one = np.eye(2)
        held = c0[:, None, None] * one + c1[:, None, None] * matrix - one
        return np.asarray(self._into @ held @ np.linalg.inv(matrix - one))

    @cached_property
    def seen(self) -> FloatArray:
        return np.asarray(np.linalg.inv(self._into))


def _differences(sections: FastSections) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Derivatives by a1 and a2: of both coefficients of a step (2, 2, n), of `enter` and of `seen`
    (2, n, 2, 2)."""
    coefficients, enter, seen = [], [], []
    for d1, d2 in ((DIFFERENCE, 0.0), (0.0, DIFFERENCE)):
        up = FastSections(sections.a1 + d1, sections.a2 + d2, sections.steps)
        down = FastSections(sections.a1 - d1, sections.a2 - d2, sections.steps)
        over = 2 * DIFFERENCE
        coefficients.append((np.array(up.coefficients) - np.array(down.coefficients)) / over)
        enter.append((up.enter - down.enter) / over)
        seen.append((up.seen - down.seen) / over)
    return np.array(coefficients), np.array(enter), np.array(seen)


@dataclass(frozen=True, eq=False)
class Stepped:
    """`paths` of a sample as those of one of its `steps`."""

    paths: Paths
    steps: int

    @cached_property
    def _real(self) -> FastPoles:
        return FastPoles(self.paths.real[0], self.steps)

    @cached_property
    def _direct(self) -> FastPoles:
        return FastPoles(self.paths.direct[:, 1], self.steps)

    @cached_property
    def _sections(self) -> FastSections:
        return FastSections(self.paths.sections[0], self.paths.sections[1], self.steps)

    @cached_property
    def fast(self) -> Paths:
        """Those of a step."""
        if self.steps == 1:
            return self.paths
        p, enter = self.paths, self._sections.enter
        weights = np.einsum("nij,jn->in", enter, p.sections[2:])
        return Paths(
            p.residue / self.steps,
            np.stack([self._real.pole, p.real[1] * self._real.weight]),
            np.concatenate([np.stack(self._sections.coefficients), weights]),
            p.port_real * self._real.weight,
            np.ascontiguousarray(np.einsum("nij,ljn->lin", enter, p.port_sections)),
            np.stack([p.direct[:, 0] * self._direct.weight, self._direct.pole], axis=1),
            p.signal_real,
            np.ascontiguousarray(np.einsum("ljn,nji->lin", p.signal_sections, self._sections.seen)),
        )

    def chain(self, rows: FloatArray, columns: PathColumns) -> None:
        """Tangents (columns, samples) by numbers of a step made those by numbers of a sample, in place."""
        if self.steps == 1:
            return
        if columns.residue >= 0:
            rows[columns.residue] /= self.steps
        self._chain_real(rows, columns)
        self._chain_direct(rows, columns)
        self._chain_sections(rows, columns)

    def _chain_real(self, rows: FloatArray, columns: PathColumns) -> None:
        p = self.paths
        for i in range(p.real.shape[1]):
            weights = [(columns.real[1, i], p.real[1, i])]
            weights += zip(columns.port_real[:, i], p.port_real[:, i], strict=True)
            pole = columns.real[0, i]
            if pole >= 0:
                rows[pole] *= self._real.pole_slope[i]
                for column, weight in weights:
                    rows[pole] += self._real.weight_slope[i] * weight * rows[column]
            for column, _ in weights:
                if column >= 0:
                    rows[column] *= self._real.weight[i]

    def _chain_direct(self, rows: FloatArray, columns: PathColumns) -> None:
        for j, (weight, pole) in enumerate(columns.direct):
            if weight < 0:
                continue
            rows[pole] *= self._direct.pole_slope[j]
            rows[pole] += self._direct.weight_slope[j] * self.paths.direct[j, 0] * rows[weight]
            rows[weight] *= self._direct.weight[j]

    def _chain_sections(self, rows: FloatArray, columns: PathColumns) -> None:
        p, enter, seen = self.paths, self._sections.enter, self._sections.seen
        if not p.sections.shape[1]:
            return
        by_coefficients, by_enter, by_seen = _differences(self._sections)
        for i in range(p.sections.shape[1]):
            weights = [(columns.sections[2:, i], p.sections[2:, i])]
            weights += zip(columns.port_sections[:, :, i], p.port_sections[:, :, i], strict=True)
            signals = list(zip(columns.signal_sections[:, :, i], p.signal_sections[:, :, i], strict=True))
            if columns.sections[0, i] >= 0:
                own = columns.sections[:2, i]
                found = by_coefficients[:, :, i] @ rows[own]
                for column, weight in weights:
                    found += (by_enter[:, i] @ weight) @ rows[column]
                for column, weight in signals:
                    if column[0] >= 0:
                        found += (weight @ by_seen[:, i]) @ rows[column]
                rows[own] = found
            for column, _ in weights:
                if column[0] >= 0:
                    rows[column] = enter[i].T @ rows[column]
            for column, _ in signals:
                if column[0] >= 0:
                    rows[column] = seen[i] @ rows[column]
