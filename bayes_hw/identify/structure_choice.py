"""Which of the fitted structures is taken."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bayes_hw.identify.growth.score_test import candidate_poles
from bayes_hw.identify.growth.search import Grown

PAIR_PARAMETERS = 4
"""Frequency, damping and two weights."""

POLE_PARAMETERS = 2
"""Place and weight."""


def choice_criterion(item: Grown, misfit: bool = False) -> float:
    """Bayesian information criterion in which poles cost what their search has cost, smaller is better.

    The criterion of Schwarz asks log n nats of log-likelihood for a real pole and 2 log n for a pair: it
    drops lags and resonances of weak evidence, and other poles move to make up for them. Each is charged its
    parameters and the logarithm of the number of places it was looked for at instead, since noise alone gains
    that much at its best place (the penalty of Akaike 1974, doi 10.1109/TAC.1974.1100705, and the
    look-elsewhere effect, Gross and Vitells 2010, doi 10.1140/epjc/s10052-010-1470-8): a pair the n / 2
    frequencies that n samples resolve, a real pole the time constants on the grid of candidates.

    Where coloured noise has hidden a `misfit`, what is left is not noise alone, and real poles follow what of
    it is slow: they cost what Schwarz asks.
    """
    samples = item.point.samples
    pairs = pole_pairs(item)
    real = item.structure.order - int(item.structure.integrator) - 2 * pairs
    charged = PAIR_PARAMETERS + np.log(samples / 2), POLE_PARAMETERS + np.log(len(candidate_poles()))
    asked = PAIR_PARAMETERS * np.log(samples), POLE_PARAMETERS * np.log(samples)
    saved = [max(float(a - 2 * c), 0.0) for a, c in zip(asked, charged, strict=True)]
    return item.criterion - pairs * saved[0] - (0.0 if misfit else real * saved[1])


def chosen(items: Iterable[Grown], misfit: bool = False) -> Grown:
    """The one of the smallest choice criterion."""
    return min(items, key=lambda item: choice_criterion(item, misfit))


def pole_pairs(item: Grown) -> int:
    """How many pairs of conjugate poles G has."""
    a1, a2 = item.values.sections[:2]
    return int(np.count_nonzero(a1 * a1 / 4 < a2))
