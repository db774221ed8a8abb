"""An error of the reading that is any function of position, beside whatever has a name.

The function is piecewise linear and estimated by generalised least squares together with the base, taken out
of the readings, and the base descended again: its score is then that of any explanation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

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
    """An explanation of readings that a function of position was taken from."""

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
        bent = tuple(replace(r, y=r.y - shape @ hat) for r, hat in zip(records, hats, strict=True))
        response = replace(fit.response, records=bent)
        begun = evaluate(response, fit.point.coordinates)
        fit = ShapedFit(response, descend(response, begun, FULL_STEPS), taken=count)
        whitener = fit.point.whitener
    return fit


def best_coefficients(
    fit: GivenFit, base: GivenFit, columns: Sequence[FloatArray], whitener: Whitener
) -> FloatArray:
    """Of columns (n, samples) of every record, by generalised least squares from the readings as they are in
    `base` under the coordinates of `fit`, its base free beside them."""
    response = base.response
    blocks = []
    for i, (rows, _, measured) in enumerate(response.linearise(fit.point.coordinates, whitener.order)):
        own = columns[i]
        if response.weights is not None:
            own = own / response.weights[i]
        white = whitener.apply(np.concatenate([own, rows]), 0, mask_of(response.masks, i))
        blocks.append(white if measured is None else white[:, measured])
    joined = np.concatenate(blocks, axis=1)
    tangents, target = joined[:-1], joined[-1]
    norms = np.maximum(np.linalg.norm(tangents, axis=1), 1e-300)
    scaled = tangents / norms[:, None]
    # The base is held by its prior; here a ridge keeps what the columns make up for from running off.
    gram = scaled @ scaled.T + RIDGE * np.eye(len(scaled))
    found = np.linalg.solve(gram, scaled @ target) / norms
    return np.asarray(found[: len(columns[0])], dtype=np.float64)
