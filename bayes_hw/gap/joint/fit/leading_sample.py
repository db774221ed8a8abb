"""G's leading coefficient where it is not certain which sample of its impulse response is the first.

A first sample that is small costs a search next to nothing to leave out, and then the second one, which may
be many times larger, looks like the first; and a delay that is a little short begins with samples that are
zero. Explanations with one and two samples more, not yet descended, and with one and two fewer are averaged
with the one at hand by their evidence: a sample more is a linear parameter, uniform between zero and the
leading coefficient behind it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy import stats

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.joint.fit.joint_fit import JointFit
from bayes_hw.gap.joint.response.joint_values import JointValues
from bayes_hw.identify.growth.descent import whitened_blocks
from bayes_hw.identify.growth.score_test import outside_of_derivatives
from bayes_hw.identify.holes import mask_of

MOST = 2
"""Samples more or fewer that may come before the first."""

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


def first_samples(values: JointValues) -> FloatArray:
    """The first samples (MOST + 1,) of the impulse response of G, which its weights are the sum of."""
    c = values.cascade
    a1, a2, b0, b1 = c.sections
    poles, weights = c.real
    found, before, now = [], b0, b1 + a1 * b0
    for k in range(MOST + 1):
        found.append(float(c.integrator_residue + np.sum(weights * poles**k) + np.sum(before)))
        before, now = now, a1 * now - a2 * before
    return np.array(found)


def leading_draws(
    fit: JointFit, samples: FloatArray, inflation: float, rng: np.random.Generator
) -> FloatArray:
    """Draws (draws,) of the leading coefficient from those (draws, n) of the first samples of the impulse
    response at the delay that was found."""
    drawn = samples[:, 0]
    count = min(MOST, fit.structure.delay_samples)
    first = float(np.median(drawn))
    if first == 0.0:
        return drawn
    choices, weights = [drawn], [1.0]
    for later, weight in _where_first_is_zero(samples):
        choices.append(later)
        weights.append(weight)
    weight = 1.0
    for j in range(1, count + 1):
        means, covariance = earlier_samples(fit, j)
        if not (np.isfinite(means).all() and np.isfinite(covariance).all()):
            break
        mean, sd = float(means[-1]), inflation * float(np.sqrt(covariance[-1, -1]))
        weight *= _evidence(mean, sd, first)
        choices.append(mean + sd * rng.standard_normal(len(drawn)))
        weights.append(weight)
    shares = np.array(weights)
    chosen = rng.choice(len(shares), len(drawn), p=shares / shares.sum())
    return np.stack(choices)[chosen, np.arange(len(drawn))]


def _where_first_is_zero(samples: FloatArray) -> Iterator[tuple[FloatArray, float]]:
    """Of draws (draws, n) of the first samples: the second where the first is zero, the third where both are,
    and so on, each with its evidence over the first."""
    weight = 1.0
    while samples.shape[1] > 1:
        first, rest = samples[:, 0], samples[:, 1:]
        variance = float(np.var(first))
        if variance == 0:
            return
        slopes = (first - first.mean()) @ rest / (len(first) * variance)
        samples = rest - np.outer(first, slopes)
        next_one = float(np.median(samples[:, 0]))
        if next_one == 0:
            return
        weight /= _evidence(float(first.mean()), float(np.sqrt(variance)), next_one)
        yield samples[:, 0], weight


def _evidence(mean: float, sd: float, first: float) -> float:
    """Of one sample more over none: its likelihood averaged over a uniform prior from zero to `first`."""
    low, high = sorted((0.0, first))
    inside = float(stats.norm.cdf(high, mean, sd) - stats.norm.cdf(low, mean, sd))
    at_none = float(stats.norm.logpdf(0.0, mean, sd))
    found = float(np.log(inside + np.finfo(float).tiny) - np.log(abs(first))) - at_none
    return float(np.exp(np.clip(found, -LARGEST_NATS, LARGEST_NATS)))
