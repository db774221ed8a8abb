"""Which two effects promise most together, judged by their responses before either is fitted.

A fit of one effect alone can end far from where it helps beside another: both are then screened at once,
every start of the one with every start of the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.fit.hypothesis import Candidate
from bayes_hw.gap.search.screen import Screen
from bayes_hw.gap.simulate.parallel import Each

FEWEST_TIMES, MOST_TIMES = 0.3, 3.0
"""Factors between which a response may be scaled: an effect of that size has about that response."""

FORMS_OF_A_PAIR = 2
"""Pairs of forms of one pair of labels, the best start of each."""


def promising_pairs(
    screen: Screen, forms: Sequence[Sequence[Candidate]], each: Each
) -> list[tuple[float, list[Candidate]]]:
    """Pairs of candidates of different labels and the reduction that they promise, best first.

    `forms` are the candidates of every effect. The reduction is that of both responses as they are, or scaled
    to fit best where that is by little, in units of twice the log-likelihood.
    """
    kept = [candidates for candidates in forms if candidates]
    if len(kept) < 2:
        return []
    responses = np.concatenate(each(screen.responses, kept), axis=1)
    own = [candidate for candidates in kept for candidate in candidates]
    labels = np.array([candidate.effect.label for candidate in own])
    promised = joint_reductions(responses, screen.residual)
    found = []
    for one, other in combinations(sorted(set(labels)), 2):
        rows, columns = np.flatnonzero(labels == one), np.flatnonzero(labels == other)
        block = promised[np.ix_(rows, columns)]
        tried: set[tuple[str, str]] = set()
        for best in np.argsort(-block, axis=None):
            row, column = np.unravel_index(int(best), block.shape)
            pair = [own[rows[row]], own[columns[column]]]
            forms_of_pair = (pair[0].effect.name, pair[1].effect.name)
            if forms_of_pair not in tried:
                tried.add(forms_of_pair)
                found.append((float(block[row, column]), pair))
            if len(tried) == FORMS_OF_A_PAIR:
                break
    return sorted(found, key=lambda pair: -pair[0])


def joint_reductions(responses: FloatArray, residual: FloatArray) -> FloatArray:
    """By how much every two of the responses (samples, n) reduce the residual's (samples,) square: (n, n)."""
    gram, towards = responses.T @ responses, responses.T @ residual
    square = np.diag(gram)
    as_they_are = 2 * towards - square
    both = as_they_are[:, None] + as_they_are[None, :] - 2 * gram
    determinant = np.maximum(np.multiply.outer(square, square) * (1 + 1e-9) - gram**2, 1e-300)
    times = (square[None, :] * towards[:, None] - gram * towards[None, :]) / determinant
    fair = (times > FEWEST_TIMES) & (times < MOST_TIMES)
    scaled = times * towards[:, None]
    return np.where(fair & fair.T, np.maximum(both, scaled + scaled.T), both)
