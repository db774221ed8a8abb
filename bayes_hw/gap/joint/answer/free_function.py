"""A function estimated in place of an effect's law, and how it is shown beside that law.

Where an effect is a function of something that moves (force of speed, error of position, gain of time), that
function is estimated anew as a piecewise linear one, all else as fitted, under the fitted noise: points that
follow the law were not made by it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.draws import NORMAL_HALF_WIDTH
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.residuals.readings import Readings
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.gap.joint.response.kernel_numbers import Simulated
from bayes_hw.record import Record

KNOTS = 13
RIDGE = 1e-6
LINE_BINS = 120

Rows: TypeAlias = Callable[[FloatArray], FloatArray]
"""Signals (n, samples) to what they change in y (n, samples)."""


@dataclass(frozen=True, eq=False)
class EffectView:
    """`y` over `x` (points,) with half widths `half` of 94 % intervals, and the answer's law as a line.

    `reading` says how to read it; `logarithmic` that both axes are.
    """

    quantity: str
    quantity_unit: str
    over: str
    over_unit: str
    x: FloatArray
    y: FloatArray
    half: FloatArray
    line_x: FloatArray
    line_y: FloatArray
    reading: str
    logarithmic: bool = False


@dataclass(frozen=True, eq=False)
class Seen:
    """What a view is made from: the fit with the answer's effects, and the readings' faults."""

    fit: JointFit
    readings: Readings

    @property
    def records(self) -> Sequence[Record]:
        return self.fit.response.records

    @property
    def rate(self) -> float:
        return self.fit.response.scale.rate_hz

    def runs(self, values: JointValues) -> list[Simulated]:
        """The motion along every record, corrected by its readings where the fit is."""
        return [self.fit.response.along(values, number) for number in range(len(self.records))]

    def delayed_commands(self) -> list[FloatArray]:
        """The command (samples,) of every record as G meets it."""
        delay = self.fit.structure.delay_samples
        return [np.concatenate([np.zeros(delay), r.u])[: len(r)] for r in self.records]

    def whitened(self, number: int, rows: FloatArray) -> FloatArray:
        """Innovations (n, samples measured) of rows (n, samples) of a record, as the noise was fitted."""
        measured = self.fit.response.measured(number)
        white = self.fit.point.whitener.apply(rows, 0, measured)
        return white if measured is None else white[:, measured]

    def number(self, label: str) -> int | None:
        """Which effect of the fit has this label; known inputs and an observer, which stand among them, and
        causes of the noise, which do not, have none."""
        forms = [effect.form for effect in self.fit.response.template]
        return next((i for i, form in enumerate(forms) if form.label == label and not form.column), None)


def _knots(x: Sequence[FloatArray]) -> FloatArray:
    """Where the free function bends: half by quantiles of x, half evenly, so that neither crowds."""
    joined = np.concatenate(list(x))
    by_quantile = np.quantile(joined, np.linspace(0, 1, KNOTS))
    evenly = np.linspace(joined.min(), joined.max(), KNOTS)
    knots = np.unique((by_quantile + evenly) / 2)
    spaced = [float(knots[0])]
    least = 0.02 * float(np.ptp(joined))
    for knot in knots[1:]:
        if knot - spaced[-1] >= least:
            spaced.append(float(knot))
    return np.array(spaced)


def _hats(x: FloatArray, knots: FloatArray) -> FloatArray:
    """Linear B-splines (knots, samples)."""
    return np.array([np.interp(x, knots, row) for row in np.eye(len(knots))])


def free_function(
    seen: Seen,
    x: Sequence[FloatArray],
    law: Sequence[FloatArray],
    paths: Sequence[Rows],
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Knots, values and half widths of 94 % intervals (knots,) of the function that stands in place of `law`.

    `x` and `law` are (samples,) a record, and `paths` take signals to what they change in y. Generalised
    least squares under the fitted noise and weights.
    """
    knots = _knots(x)
    weights = seen.fit.response.weights
    rows = []
    for i, (own, values, path, e) in enumerate(zip(x, law, paths, seen.fit.errors, strict=True)):
        block = np.vstack([path(_hats(own, knots)), e + path(values[None, :])[0]])
        rows.append(seen.whitened(i, block if weights is None else block / weights[i]))
    joined = np.concatenate(rows, axis=1)
    basis, target = joined[:-1].T, joined[-1]
    norms = np.linalg.norm(basis, axis=0)
    kept = norms > 1e-9 * norms.max()
    scaled = basis[:, kept] / norms[kept]
    gram = scaled.T @ scaled + RIDGE * np.eye(int(kept.sum()))
    found = np.linalg.solve(gram, scaled.T @ target)
    variance = float(np.mean((target - scaled @ found) ** 2))
    spread = np.sqrt(variance * np.diag(np.linalg.inv(gram)))
    return knots[kept], found / norms[kept], NORMAL_HALF_WIDTH * spread / norms[kept]


def _line(x: Sequence[FloatArray], law: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """The law as it was met: means of its values over bins of x."""
    joined, values = np.concatenate(list(x)), np.concatenate(list(law))
    edges = np.linspace(joined.min(), joined.max(), LINE_BINS + 1)
    at = np.clip(np.searchsorted(edges, joined, side="right") - 1, 0, LINE_BINS - 1)
    count = np.bincount(at, minlength=LINE_BINS)
    total = np.bincount(at, weights=values, minlength=LINE_BINS)
    met = count > 0
    return ((edges[:-1] + edges[1:]) / 2)[met], total[met] / count[met]


def viewed(
    seen: Seen,
    x: Sequence[FloatArray],
    law: Sequence[FloatArray],
    paths: Sequence[Rows],
    words: tuple[str, str, str, str, str],
    scales: tuple[float, float] = (1.0, 1.0),
) -> EffectView:
    """A free function as a view; `scales` multiply x and y."""
    knots, values, half = free_function(seen, x, law, paths)
    line_x, line_y = _line(x, law)
    across, up = scales
    quantity, quantity_unit, over, over_unit, reading = words
    return EffectView(
        quantity, quantity_unit, over, over_unit, across * knots, up * values, abs(up) * half,
        across * line_x, up * line_y, reading,
    )  # fmt: skip
