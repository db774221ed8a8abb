"""G's leading coefficient where it is not certain which sample of its impulse response is the first.

A first sample that is small costs a search next to nothing to leave out, and then the second one, which may
be many times larger, looks like the first. Explanations with one and two samples more, not yet descended,
are averaged with the one at hand by their evidence: a sample more is a linear parameter, uniform between zero
and the leading coefficient that was found.
"""

from __future__ import annotations

import numpy as np
from scipy import stats

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import whitened_blocks
from bayes_hw.identify.growth.score_test import outside_of_derivatives
from bayes_hw.identify.holes import mask_of

MOST_EARLIER = 2
SINGULAR = 1e-9
LARGEST_NATS = 14.0
"""Of evidence either way: beyond it nothing is left of an explanation among the draws."""


def earlier_samples(fit: JointFit, count: int) -> tuple[FloatArray, FloatArray]:
    """Means (count,) and covariance (count, count) of samples of the impulse response before the first, the
    latest first, all coordinates free along; infinite where the axis never leaves its dead zone, and nothing
    tells of them."""
    whitener = fit.point.whitener
    rows = list(whitened_blocks(fit.response, fit.point.coordinates, whitener))
    basis, left = outside_of_derivatives(np.concatenate(rows, axis=1))
    parts = []
    for number, (v, outside) in enumerate(fit.response.gated(fit.point.coordinates)):
        moved = [np.concatenate([v[i:], np.full(i, v[-1])]) * outside for i in range(count)]
        parts.append(whitener.apply(np.stack(moved), 0, mask_of(fit.point.masks, number)))
    columns = np.concatenate(parts, axis=1)
    columns = columns - (columns @ basis) @ basis.T
    gram = columns @ columns.T
    if not gram.any():
        return np.zeros(count), np.full((count, count), np.inf)
    gram += SINGULAR * np.trace(gram) / count * np.eye(count)
    covariance = np.linalg.inv(gram)
    return covariance @ (columns @ left), covariance * float(left @ left) / len(left)


def second_sample(values: JointValues) -> float:
    """Of the impulse response of G, the one behind the first that its weights are the sum of."""
    c = values.cascade
    a1, _, b0, b1 = c.sections
    return float(c.integrator_residue + np.sum(c.real[0] * c.real[1]) + np.sum(b1 + a1 * b0))


def leading_draws(
    fit: JointFit, drawn: FloatArray, second: FloatArray, inflation: float, rng: np.random.Generator
) -> FloatArray:
    """Draws (draws,) of the leading coefficient from those at the delay that was found, of the first and the
    `second` sample."""
    count = min(MOST_EARLIER, fit.structure.delay_samples)
    first, variance = float(np.median(drawn)), float(np.var(drawn))
    if first == 0.0:
        return drawn
    means, spreads, weights = [0.0], [0.0], [1.0]
    later, none = drawn, 0.0
    if variance > 0 and fit.structure.order:
        # Of the second sample where the first is zero.
        slope = float(np.mean((drawn - drawn.mean()) * (second - second.mean()))) / variance
        later = second - slope * drawn
        next_one = float(np.median(later))
        if next_one != 0:
            none = 1 / _evidence(float(drawn.mean()), float(np.sqrt(variance)), next_one)
    for j in range(1, count + 1):
        mean, covariance = earlier_samples(fit, j)
        if not (np.isfinite(mean).all() and np.isfinite(covariance).all()):
            break
        means.append(float(mean[-1]))
        spreads.append(inflation * float(np.sqrt(covariance[-1, -1])))
        weights.append(weights[-1] * _evidence(means[-1], spreads[-1], first))
    shares = np.array([*weights, none])
    chosen = rng.choice(len(shares), len(drawn), p=shares / shares.sum())
    means.append(0.0)
    spreads.append(0.0)
    other = np.array(means)[chosen] + np.array(spreads)[chosen] * rng.standard_normal(len(drawn))
    return np.where(chosen == len(weights), later, np.where(chosen == 0, drawn, other))


def _evidence(mean: float, sd: float, first: float) -> float:
    """Of one sample more over none: its likelihood averaged over a uniform prior from zero to `first`."""
    low, high = sorted((0.0, first))
    inside = float(stats.norm.cdf(high, mean, sd) - stats.norm.cdf(low, mean, sd))
    at_none = float(stats.norm.logpdf(0.0, mean, sd))
    found = float(np.log(inside + np.finfo(float).tiny) - np.log(abs(first))) - at_none
    return float(np.exp(np.clip(found, -LARGEST_NATS, LARGEST_NATS)))
