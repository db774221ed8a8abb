"""How explanations predict blocks of the records that they were not fitted to.

Evidence asks how probable the records were before any was seen, and polarises where every model is a little
wrong. Here each block is predicted from the rest, by every explanation linear about its own estimate, and the
predictions are stacked (Yao et al., doi 10.1214/17-BA1091). The noise stays as it was estimated. Shown beside
the answer, which goes by the evidence: the choice among many effects and periods was made on all blocks.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.noise.stochastic_fit import autoregression
from bayes_hw.gap.noise.whitener import LOG_2PI, Whitener

BLOCKS = 12
"""Of every record."""

MOST_COMPARED = 8
ROUNDS = 300

IMPULSES_APART = 64
"""Samples after which a whitener has forgotten an impulse."""


@dataclass(frozen=True)
class LeftOut:
    """Of one explanation: its log predictive `density` of all left-out blocks less that of the best, the
    standard `error` of that, and its `weight` in the stacked prediction."""

    density: float
    error: float
    weight: float


def compare_left_out(found: Mapping[tuple[str, ...], Explanation]) -> dict[tuple[str, ...], LeftOut]:
    """The explanations of most evidence by how they predict left-out blocks; empty where fewer than two can.

    Those whose encoder repeats or rounds samples have no density of single samples, and are not compared;
    plain residuals that count for fewer are given the autoregression that they follow.
    """
    best = sorted(found.items(), key=lambda item: -item[1].log_evidence)[:MOST_COMPARED]
    densities = {labels: block_densities(_with_density(e)) for labels, e in best if e.display is None}
    if len(densities) < 2:
        return {}
    every = np.array(list(densities.values()))
    behind = every - every[np.argmax(every.sum(axis=1))]
    errors = np.sqrt(behind.shape[1] * np.var(behind, axis=1))
    numbers = zip(behind.sum(axis=1), errors, stacking_weights(every), strict=True)
    return {labels: LeftOut(*map(float, own)) for labels, own in zip(densities, numbers, strict=True)}


def _with_density(explanation: Explanation) -> Explanation:
    fit = explanation.fit
    if fit.whitener.has_density:
        return explanation
    return replace(explanation, fit=replace(fit, whitener=autoregression(fit)))


def stacking_weights(densities: FloatArray) -> FloatArray:
    """Weights (models,), of sum one, of the mixture that predicts best: log-densities (models, blocks).

    The mean log-density of the mixture is concave in the weights; each round of expectation and maximisation
    (doi 10.1111/j.2517-6161.1977.tb01600.x) raises it.
    """
    relative = np.exp(densities - densities.max(axis=0))
    weights = np.full(len(relative), 1 / len(relative))
    for _ in range(ROUNDS):
        weights = weights * np.mean(relative / (weights @ relative), axis=1)
    return weights


def block_densities(explanation: Explanation, blocks: int = BLOCKS) -> FloatArray:
    """Log predictive density (records * blocks,) of every block given the rest of the records.

    With whitened residuals w and derivatives J of a block, A the precision of all and B = A - J'J that of the
    rest, whose descent is d, the residuals left out are w - J B^-1 d, of variance (I - J A^-1 J')^-1. At a
    minimum of all d is -J'w; plain least squares end beside that of coloured noise.
    """
    fit, whitener = explanation.fit, explanation.fit.whitener
    white = [whitener.whiten(e[:, None], record)[:, 0] for record, e in enumerate(fit.residuals)]
    tangents = [whitener.whiten(j, record) for record, j in enumerate(fit.jacobians)]
    precision, descent = fit.precision(), fit.descent()
    _, all_of_it = np.linalg.slogdet(precision)
    found = []
    for w, j, scale in zip(white, tangents, _log_scales(whitener, white), strict=True):
        for rows in np.array_split(np.arange(len(w)), blocks):
            rest = precision - j[rows].T @ j[rows]
            left_out = w[rows] - j[rows] @ np.linalg.solve(rest, descent - j[rows].T @ w[rows])
            along = j[rows].T @ left_out
            square = float(left_out @ left_out) - float(along @ np.linalg.solve(precision, along))
            _, without = np.linalg.slogdet(rest)
            found.append(float(scale[rows].sum()) - 0.5 * square + 0.5 * float(without - all_of_it))
    return np.array(found)


def _log_scales(whitener: Whitener, white: list[FloatArray]) -> list[FloatArray]:
    """Log-density (samples,) of whitened residuals of zero, a record each.

    The whitener is triangular, so that the answer to an impulse at once is the scale of its sample; the sum
    is that of the log-likelihood, a sample that is no reading counting for none.
    """
    found = []
    for record, w in enumerate(white):
        rows = np.arange(len(w))
        impulses = np.zeros((len(w), min(IMPULSES_APART, len(w))))
        impulses[rows, rows % IMPULSES_APART] = 1.0
        at_once = np.abs(whitener.whiten(impulses, record)[rows, rows % IMPULSES_APART])
        found.append(np.where(at_once > 0, np.log(np.maximum(at_once, 1e-300)) - 0.5 * LOG_2PI, 0.0))
    total = whitener.log_likelihood + 0.5 * sum(float(w @ w) for w in white)
    missing = (total - sum(float(s.sum()) for s in found)) / sum(map(len, white))
    return [s + missing for s in found]
