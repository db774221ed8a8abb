"""An error of the reading that is any function of position, beside whatever has a name.

The function is piecewise linear and estimated by generalised least squares together with the base, taken out
of the readings, and the base descended again: its score is then that of any explanation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import FULL_STEPS, LABEL_PRICE_NATS
from bayes_hw.gap.joint.given.given_response import GivenFit
from bayes_hw.gap.joint.search.effect_screen import first_order_noise
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import descend, evaluate
from bayes_hw.identify.holes import mask_of

KNOTS = (12, 24, 48)
ROUNDS = 2
RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class ShapedFit(GivenFit):
    """An explanation of readings that a function of position was taken from: of `hats` (knots, samples) of
    every record."""

    hats: tuple[FloatArray, ...] = ()

    def factor(self) -> FloatArray:
        """Triangular factor (size + 1, size + 1) of the whitened derivatives and residual, less what the
        function explains of them, and the prior."""
        whitener, size = self.point.whitener, self.response.size
        joined = np.concatenate(list(_whitened(self, self.hats, whitener)), axis=1)
        factor = linalg.qr(joined.T, mode="r", check_finite=False)[0]
        factor = factor[self.taken : self.taken + size + 1, self.taken :]
        variance = float(factor[-1, -1] ** 2) / self.point.samples
        root = np.sqrt(self.response.prior_precision() * variance)
        known = np.column_stack([np.diag(root), -root * self.point.coordinates])
        return np.asarray(linalg.qr(np.concatenate([factor, known]), mode="r")[0][: size + 1])

    @property
    def score(self) -> float:
        """As of any fit, less the price of a label; that of the knots is in what was taken."""
        return super().score - LABEL_PRICE_NATS


def free_shape(base: GivenFit) -> ShapedFit:
    """The best of a few numbers of knots, beside what explains the readings in `base`."""
    return max((_with_knots(base, count) for count in KNOTS), key=lambda fit: fit.score)


def _with_knots(base: GivenFit, count: int) -> ShapedFit:
    records = base.response.records
    values = base.values
    first = np.concatenate([base.response.simulate(values, r.u, r.known).w for r in records])
    knots = np.linspace(first.min(), first.max(), count)
    fit = ShapedFit(base.response, base.point, taken=count)
    whitener = base.point.whitener
    if whitener.order > 1:
        whitener = first_order_noise(base.point.residuals)
    for _ in range(ROUNDS):
        values = fit.values
        reached = [base.response.simulate(values, r.u, r.known).w for r in records]
        hats = [np.array([np.interp(w, knots, row) for row in np.eye(count)]) for w in reached]
        shape = best_coefficients(fit, base, hats, whitener)
        if not np.isfinite(shape).all():
            return fit
        bent = tuple(replace(r, y=r.y - shape @ hat) for r, hat in zip(records, hats, strict=True))
        response = replace(fit.response, records=bent)
        begun = evaluate(response, fit.point.coordinates)
        fit = ShapedFit(response, descend(response, begun, FULL_STEPS), taken=count, hats=tuple(hats))
        whitener = fit.point.whitener
    return fit


def best_coefficients(
    fit: GivenFit, base: GivenFit, columns: Sequence[FloatArray], whitener: Whitener
) -> FloatArray:
    """Of columns (n, samples) of every record, by generalised least squares from the readings as they are in
    `base` under the coordinates of `fit`, its base free beside them but for its prior."""
    at = replace(base, point=evaluate(base.response, fit.point.coordinates, whitener))
    joined = np.concatenate(list(_whitened(at, columns, whitener)), axis=1)
    tangents, target = joined[:-1], joined[-1]
    count = len(columns[0])
    norms = np.linalg.norm(tangents, axis=1)
    norms[norms == 0] = 1.0  # Limits that no command reaches are seen by their prior alone.
    scaled = tangents / norms[:, None]
    # A straight line is a gain too: which of them, the prior says; a ridge what it leaves open.
    gram, product = scaled @ scaled.T + RIDGE * np.eye(len(scaled)), scaled @ target
    variance = at.point.sum_of_squares / at.point.samples
    prior = base.response.prior_precision() * variance / norms[count:] ** 2
    gram[count:, count:] += np.diag(prior)
    product[count:] -= prior * norms[count:] * at.point.coordinates
    found = np.linalg.solve(gram, product) / norms
    return np.asarray(found[:count], dtype=np.float64)


def _whitened(fit: GivenFit, columns: Sequence[FloatArray], whitener: Whitener) -> Iterator[FloatArray]:
    """Innovations (n + size + 1, samples measured) of columns (n, samples), derivatives and residual of every
    record."""
    response = fit.response
    for i, (rows, _, measured) in enumerate(response.linearise(fit.point.coordinates, whitener.order)):
        own = columns[i]
        if response.weights is not None:
            own = own / response.weights[i]
        white = whitener.apply(np.concatenate([own, rows]), 0, mask_of(response.masks, i))
        yield white if measured is None else white[:, measured]
