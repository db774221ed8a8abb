"""What a further pole or pair would gain, by score tests on the whitened derivatives (Rao 1948,
doi 10.1017/S0305004100023987): no descent is needed to rank a few hundred candidates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.identify.growth.cascade_response import CascadeResponse
from bayes_hw.identify.growth.descent import Point, whitened_blocks
from bayes_hw.identify.growth.sensitivity_kernel import filtered_pair, filtered_pole
from bayes_hw.identify.holes import mask_of

REAL_DECADES = np.linspace(0.15, 4.0, 14)
PAIR_DAMPING = (0.01, 0.05, 0.15, 0.4, 0.8)
LOW_FREQUENCIES, HIGH_FREQUENCIES = 24, 32
COLUMN_NUMBERS = 4_000_000
"""Numbers that the columns of candidates tested at a time hold at most."""

SINGULAR = 1e-10
"""Share of a column that must lie outside the present derivatives to count."""


@dataclass(frozen=True)
class Candidate:
    """A real pole (`a2` None, `a1` the pole) or a section's denominator."""

    a1: float
    a2: float | None


def candidate_poles() -> FloatArray:
    """Real poles on a grid of time constants, negative ones among them."""
    positive = 1 - 10.0**-REAL_DECADES
    return np.concatenate([positive, [0.0, -0.4, -0.8, -0.95, -0.99]])


def candidate_pairs() -> FloatArray:
    """Denominators (n, 2): frequencies from 1/2000 of the sample rate, in steps of a ratio and then even
    ones, at several damping ratios."""
    low = np.geomspace(2 * np.pi / 2000, 2 * np.pi / 20, LOW_FREQUENCIES, endpoint=False)
    angle = np.concatenate([low, np.linspace(2 * np.pi / 20, 0.98 * np.pi, HIGH_FREQUENCIES)])
    found = []
    for damping in PAIR_DAMPING:
        radius = np.exp(-angle * damping)
        turned = angle * np.sqrt(1 - damping**2)
        found.append(np.stack([2 * radius * np.cos(turned), radius**2], axis=1))
    return np.concatenate(found)


def outside_of_derivatives(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Orthonormal basis (samples, n) of whitened derivatives, and what of the residual lies outside of it.

    `rows` (parameters + 1, samples) as `CascadeResponse.linearise` gives them: the residual comes last.
    """
    derivatives, e = rows[:-1], rows[-1]
    norms = np.sqrt(np.sum(derivatives**2, axis=1))
    used = derivatives[norms > 0] / norms[norms > 0, None]
    basis = linalg.qr(used.T, mode="economic", check_finite=False)[0]
    return basis, e - basis @ (basis.T @ e)


@dataclass(frozen=True, eq=False)
class Residual:
    """Whitened residual and derivatives of a point, ready for any number of score tests."""

    response: CascadeResponse
    point: Point
    basis: FloatArray
    residual: FloatArray

    @classmethod
    def of(cls, response: CascadeResponse, point: Point) -> Residual:
        blocks = list(whitened_blocks(response, point.coordinates, point.whitener))
        return cls(response, point, *outside_of_derivatives(np.concatenate(blocks, axis=1)))

    def gains(self, columns: FloatArray) -> FloatArray:
        """Promised gains of groups of columns (groups, columns of a group, samples), whitened already."""
        groups, width, length = columns.shape
        flat = columns.reshape(-1, length)
        inside = flat @ self.basis
        power = np.sum(flat**2, axis=1).reshape(groups, width)
        products = (flat @ self.residual).reshape(groups, width)
        inside = inside.reshape(groups, width, -1)
        gram = columns @ columns.transpose(0, 2, 1) - inside @ inside.transpose(0, 2, 1)
        scale = np.sqrt(np.maximum(power, np.finfo(float).tiny))
        gram /= scale[:, :, None] * scale[:, None, :]
        gram += SINGULAR * np.eye(width)
        scaled = products / scale
        explained = np.einsum("gi,gi->g", scaled, np.linalg.solve(gram, scaled[:, :, None])[:, :, 0])
        share = np.clip(explained / float(self.residual @ self.residual), 0.0, 1 - 1e-12)
        return -0.5 * self.point.samples * np.log1p(-share)

    def pole_gains(self, poles: FloatArray) -> FloatArray:
        """Of one further real pole each."""
        return np.concatenate(
            [
                self.gains(self._columns(len(part), 1, lambda i, v, out: filtered_pole(v, part[i], out[0])))  # noqa: B023
                for part in self._parts(poles, 1)
            ]
        )

    def group_gains(self, poles: FloatArray, groups: Sequence[tuple[int, int]]) -> FloatArray:
        """Of two further real poles each, given by their numbers among `poles`."""
        columns = self._columns(len(poles), 1, lambda i, v, out: filtered_pole(v, poles[i], out[0]))
        return self.gains(columns[np.array(groups), 0])

    def pair_gains(self, pairs: FloatArray) -> FloatArray:
        """Of one further section each, given its denominator (n, 2)."""
        return np.concatenate(
            [
                self.gains(
                    self._columns(len(part), 2, lambda i, v, out: filtered_pair(v, *part[i], out[0], out[1]))  # noqa: B023
                )
                for part in self._parts(pairs, 2)
            ]
        )

    def _parts(self, candidates: FloatArray, width: int) -> list[FloatArray]:
        """Candidates a part at a time, so that their columns hold no more than COLUMN_NUMBERS."""
        at_once = max(1, COLUMN_NUMBERS // (width * len(self.residual)))
        return [candidates[i : i + at_once] for i in range(0, len(candidates), at_once)]

    def _columns(
        self, groups: int, width: int, fill: Callable[[int, FloatArray, FloatArray], None]
    ) -> FloatArray:
        parts, masks = [], self.response.masks
        for number, (v, outside) in enumerate(self.response.gated(self.point.coordinates)):
            part = np.empty((groups, width, len(v)))
            for i in range(groups):
                fill(i, v, part[i])
            part *= outside
            white = self.point.whitener.apply(part.reshape(-1, len(v)), 0, mask_of(masks, number))
            parts.append(white.reshape(groups, width, -1))
        return np.concatenate(parts, axis=2)


def best_candidates(
    response: CascadeResponse, point: Point, count: int
) -> tuple[list[Candidate], list[Candidate]]:
    """The most promising real poles and sections, `count` of each, no two neighbours on their grids."""
    residual = Residual.of(response, point)
    poles, pairs = candidate_poles(), candidate_pairs()
    pole_gains, pair_gains = residual.pole_gains(poles), residual.pair_gains(pairs)
    real = [Candidate(float(poles[i]), None) for i in np.argsort(-pole_gains)]
    sections = [Candidate(float(pairs[i, 0]), float(pairs[i, 1])) for i in np.argsort(-pair_gains)]
    return _apart(real, count), _apart(sections, count)


def _apart(ranked: Sequence[Candidate], count: int) -> list[Candidate]:
    chosen: list[Candidate] = []
    for one in ranked:
        if all(_distance(one, other) > 0.35 for other in chosen):
            chosen.append(one)
        if len(chosen) == count:
            break
    return chosen


def _distance(one: Candidate, other: Candidate) -> float:
    """Difference of the logarithms of continuous poles, which is that of frequencies and of damping."""
    return float(abs(_logarithm(one) - _logarithm(other)))


def _logarithm(candidate: Candidate) -> complex:
    if candidate.a2 is None:
        pole = complex(candidate.a1 or 1e-3)
    else:
        pole = candidate.a1 / 2 + np.sqrt(complex(candidate.a1**2 / 4 - candidate.a2))
    return complex(np.log(-np.log(pole)))
