"""Errors of the reading that are linear in a few numbers given the motion, beside whatever has a name: any
function of position, or a disc that slides on its shaft where that accelerates hard.

A function of position is piecewise linear. Its values, or how far the disc slides, are estimated by
generalised least squares together with the base, taken out of the readings, and the base descended again: the
score is then that of any explanation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import FULL_STEPS, LABEL_PRICE_NATS
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.residuals.beside_fit import best_coefficients, whitened_columns
from bayes_hw.gap.joint.residuals.noise_screen import NoiseScreen, first_order_noise
from bayes_hw.identify.growth.descent import descend, evaluate

KNOTS = (12, 24, 48)
HARD_SHARES = np.geomspace(0.004, 0.1, 150)
"""Of all samples, in which the shaft accelerates so hard that the disc may slide."""

LIMIT_NUMBERS = 3
"""What a limit costs that is the best of many, numbers."""

SLIDING_NATS = 5.0
"""That sliding must promise to be fitted."""

ROUNDS, SLIDING_ROUNDS, PATIENCE = 2, 24, 8
"""Rounds of an error's numbers and the base in turn, and those without a gain that are waited for."""


@dataclass(frozen=True, eq=False)
class ShapedFit(GivenFit):
    """An explanation of readings that an error was taken from: of columns `splines` (numbers, samples) of
    every record, functions of position unless it `slides`."""

    slides: bool = False
    splines: tuple[FloatArray, ...] = ()

    @property
    def without_name(self) -> str | None:
        if self.slides:
            return "an encoder whose disc slides on its shaft where that accelerates hard"
        return "an error of the reading that is a function of position"

    def factor(self) -> FloatArray:
        """Triangular factor (size + 1, size + 1) of the whitened derivatives and residual, less what the
        function explains of them, and the prior."""
        whitener, size = self.point.whitener, self.response.size
        joined = np.concatenate(list(whitened_columns(self, self.splines, whitener)), axis=1)
        factor = linalg.qr(joined.T, mode="r", check_finite=False)[0]
        columns = len(self.splines[0])
        factor = factor[columns : columns + size + 1, columns:]
        variance = float(factor[-1, -1] ** 2) / self.point.samples
        root = np.sqrt(self.response.prior_precision() * variance)
        known = np.column_stack([np.diag(root), -root * self.point.coordinates])
        return np.asarray(linalg.qr(np.concatenate([factor, known]), mode="r")[0][: size + 1])

    @property
    def score(self) -> float:
        """As of any fit, less the price of a label; that of the knots is in what was taken."""
        return super().score - LABEL_PRICE_NATS


Columns: TypeAlias = Callable[[GivenFit, Sequence[FloatArray]], list[FloatArray]]
"""Of an explanation and the angles (samples,) it simulates, columns (numbers, samples) of every record."""


def free_shape(base: GivenFit) -> ShapedFit:
    """The best of a few numbers of knots, and of a disc that slides, beside what explains the readings in
    `base`."""
    angles_of_base = _angles(base)
    joined = np.concatenate(angles_of_base)
    ends = joined.min(), joined.max()

    def splines(count: int, _: GivenFit, angles: Sequence[FloatArray]) -> list[FloatArray]:
        knots = np.linspace(*ends, count)
        return [np.array([np.interp(w, knots, row) for row in np.eye(count)]) for w in angles]

    begun = ShapedFit(base.response, base.point)
    shaped = [_beside(base, partial(splines, n), replace(begun, taken=n), ROUNDS) for n in KNOTS]
    if _sliding(_under_little_noise(base, begun), angles_of_base)[1] > SLIDING_NATS:
        numbers = 1 + LIMIT_NUMBERS * len(base.response.records)
        shaped.append(_beside(base, _slides, replace(begun, taken=numbers, slides=True), SLIDING_ROUNDS))
    return max(shaped, key=lambda fit: fit.score)


def _angles(fit: GivenFit) -> list[FloatArray]:
    response, values = fit.response, fit.values
    return [response.simulate(values, r.u, r.known).w for r in response.records]


def _slides(at: GivenFit, angles: Sequence[FloatArray]) -> list[FloatArray]:
    """Columns of `_sliding`."""
    return _sliding(at, angles)[0]


def _sliding(at: GivenFit, angles: Sequence[FloatArray]) -> tuple[list[FloatArray], float]:
    """Steps (1, samples) of a disc against the shaft where its acceleration is beyond the limit that explains
    most of what `at` leaves, of all records and then of each: what holds the disc may change. They show where
    the dead zone does not hold the output. With the nats that they promise."""
    response, values = at.response, at.values
    slopes = [response.along(values, number).slope for number in range(len(angles))]
    weights = response.weights or [np.ones(len(w)) for w in angles]
    screen = NoiseScreen.of(at, at.point.whitener)
    steps = []
    for w, slope in zip(angles, slopes, strict=True):
        a = np.gradient(np.gradient(w))
        limits = np.quantile(np.abs(a), 1 - HARD_SHARES)
        steps.append([slope * np.cumsum(np.where(np.abs(a) > limit, np.sign(a), 0.0)) for limit in limits])

    def chosen(picks: Sequence[int]) -> list[FloatArray]:
        return [own[i][None, :] for own, i in zip(steps, picks, strict=True)]

    def gain(picks: Sequence[int]) -> float:
        return screen.gain([c / weight for c, weight in zip(chosen(picks), weights, strict=True)])

    count = range(len(HARD_SHARES))
    best = max(([i] * len(steps) for i in count), key=gain)
    for record in range(len(steps)):
        best = max(([*best[:record], i, *best[record + 1 :]] for i in count), key=gain)
    return chosen(best), gain(best)


def _beside(base: GivenFit, columns: Columns, fit: ShapedFit, rounds: int) -> ShapedFit:
    """`fit`, which begins as `base`, with an error of these columns taken out of the readings: the best of
    some rounds, each under noise of the first order at most, which takes up little of it."""
    found = [fit]
    for _ in range(rounds):
        at = _under_little_noise(base, fit)
        own = columns(at, _angles(fit))
        shape = best_coefficients(fit, base, own, at.point.whitener)
        if not np.isfinite(shape).all():
            break
        pairs = zip(base.response.records, own, strict=True)
        bent = tuple(replace(r, y=r.y - shape @ column) for r, column in pairs)
        response = replace(fit.response, records=bent)
        point = descend(response, evaluate(response, fit.point.coordinates), FULL_STEPS)
        fit = replace(fit, response=response, point=point, splines=tuple(own))
        found.append(fit)
        if len(found) > PATIENCE and fit.score < max(one.score for one in found[:-PATIENCE]):
            break
    return max(found[1:] or found, key=lambda one: one.score)


def _under_little_noise(base: GivenFit, fit: GivenFit) -> GivenFit:
    """`base` at the coordinates of `fit`, under its noise, of the first order at most."""
    whitener = fit.point.whitener
    if whitener.order > 1:
        whitener = first_order_noise(fit.point.residuals)
    return replace(base, point=evaluate(base.response, fit.point.coordinates, whitener))
