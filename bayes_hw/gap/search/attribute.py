"""Which effect: fits of the base, of every effect, of pairs, and of the stochastic effects beside them.

Every hypothesis is fitted on plain residuals first and under autoregressive noise after: with the base
misfit, a noise model fitted at once absorbs the effect, and the fit ends in a wrong minimum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.fit import Fit
from bayes_hw.gap.search.candidate_models import worst_first
from bayes_hw.gap.search.state import Search
from bayes_hw.gap.search.strategies import STRATEGIES
from bayes_hw.time_budget import time_is_up


@dataclass(frozen=True)
class Attribution:
    """Everything fitted: the base and the explanations, best evidence first; the base fits of all starts. One
    that was `cut_short` had no time left for strategies that were wanted."""

    base: Explanation
    explanations: tuple[Explanation, ...]
    base_costs: tuple[float, ...]
    singles: tuple[Fit, ...]
    cut_short: bool = False

    @property
    def best(self) -> Explanation:
        return self.explanations[0]


def attribute(search: Search) -> Attribution:
    """All explanations of a case; the search goes on while the best of them leaves structure and there is
    time."""
    search.tell("base model")
    search.begin()
    cut_short = False
    for strategy in STRATEGIES:
        if strategy.wanted(search):
            if time_is_up():
                cut_short = True
                break
            if strategy.told:
                search.tell(strategy.told)
            strategy.seek(search)
    base = search.base_alone
    known = [e for e in search.found if np.isfinite(e.log_evidence) or e is base]
    everything = sorted(known, key=worst_first)
    costs = tuple(f.cost for f in search.bases)
    return Attribution(base, tuple(everything), costs, tuple(search.singles), cut_short)
