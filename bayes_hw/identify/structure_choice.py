"""Which of the fitted structures is taken."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bayes_hw.identify.growth.search import Grown

RINGING = 0.1
"""Damping ratio below which a pair rings on as no real poles do."""

PAIR_PARAMETERS = 4
"""Frequency, damping and two weights."""


def choice_criterion(item: Grown) -> float:
    """Bayesian information criterion in which a ringing pole pair costs what its search has cost, smaller
    is better.

    The criterion of Schwarz asks 2 log n nats of log-likelihood for a pair, and drops resonances whose weak
    evidence would still have told their frequencies. A pair is charged its four parameters and the logarithm
    of the number of places it was looked for at, the n / 2 frequencies that n samples resolve: noise alone
    gains that much at its best place (the penalty of Akaike 1974, doi 10.1109/TAC.1974.1100705, and the
    look-elsewhere effect, Gross and Vitells 2010, doi 10.1140/epjc/s10052-010-1470-8).
    """
    samples = item.point.samples
    charged = 2 * (PAIR_PARAMETERS + np.log(samples / 2))
    saved = PAIR_PARAMETERS * np.log(samples) - charged
    return item.criterion - ringing_pairs(item) * max(float(saved), 0.0)


def chosen(items: Iterable[Grown]) -> Grown:
    """The one of the smallest choice criterion."""
    return min(items, key=choice_criterion)


def ringing_pairs(item: Grown) -> int:
    """How many pole pairs of G have a damping ratio below RINGING."""
    a1, a2 = item.values.sections[:2]
    a1, a2 = a1[a1 * a1 / 4 < a2], a2[a1 * a1 / 4 < a2]
    poles = np.log(a1 / 2 + 1j * np.sqrt(a2 - a1 * a1 / 4))
    return int(np.count_nonzero(-poles.real < RINGING * np.abs(poles)))
