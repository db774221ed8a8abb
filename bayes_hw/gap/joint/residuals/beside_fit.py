"""Columns of the readings that are linear in a few numbers, estimated beside a fit's own coordinates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import AnyFit
from bayes_hw.identify.growth.coloured import Whitener
from bayes_hw.identify.growth.descent import evaluate, prior_precision

RIDGE = 1e-9


def best_coefficients(
    fit: AnyFit, base: AnyFit, columns: Sequence[FloatArray], whitener: Whitener
) -> FloatArray:
    """Of columns (n, samples) of every record, by generalised least squares from the readings as they are in
    `base` under the coordinates of `fit`, its base free beside them but for its prior, where it has one; NaN
    where the derivatives overflow."""
    at = replace(base, point=evaluate(base.response, fit.point.coordinates, whitener))
    joined = np.concatenate(list(whitened_columns(at, columns, whitener)), axis=1)
    tangents, target = joined[:-1], joined[-1]
    count = len(columns[0])
    norms = np.linalg.norm(tangents, axis=1)
    norms[norms == 0] = 1.0  # Limits that no command reaches are seen by their prior alone.
    scaled = tangents / norms[:, None]
    # A straight line is a gain too: which of them, the prior says; a ridge what it leaves open.
    gram, product = scaled @ scaled.T + RIDGE * np.eye(len(scaled)), scaled @ target
    variance = at.point.sum_of_squares / at.point.samples
    prior = prior_precision(base.response, at.point.coordinates) * variance / norms[count:] ** 2
    gram[count:, count:] += np.diag(prior)
    product[count:] -= prior * norms[count:] * at.point.coordinates
    if not np.isfinite(gram).all():
        return np.full(count, np.nan)
    found = np.linalg.solve(gram, product) / norms
    return np.asarray(found[:count], dtype=np.float64)


def whitened_columns(fit: AnyFit, columns: Sequence[FloatArray], whitener: Whitener) -> Iterator[FloatArray]:
    """Innovations (n + size + 1, samples measured) of columns (n, samples), derivatives and residual of every
    record."""
    response = fit.response
    for i, (rows, _, measured) in enumerate(response.linearise(fit.point.coordinates, whitener.order)):
        own = columns[i]
        if response.weights is not None:
            own = own / response.weights[i]
        white = whitener.apply(np.concatenate([own, rows]), 0, measured)
        yield white if measured is None else white[:, measured]
