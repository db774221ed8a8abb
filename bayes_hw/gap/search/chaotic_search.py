"""Two effects of which one makes the motion chaotic: both fitted under slow noise.

Residuals of a chaotic motion are large however good the model, so that plain least squares cannot tell what
else is there; under the slow noise that stands for the motion that cannot be followed, a second effect shows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.fit import evaluated
from bayes_hw.gap.fit.hypothesis import Candidate, Hypothesis
from bayes_hw.gap.fit.joint_fits import joined
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.multistart import square_errors
from bayes_hw.gap.search.screen import Screen, best_forms
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each

PARTNERS_TRIED = 4
HOSTS_TRIED = 2
ROUNDS = 1
BETWEEN = 7
"""Places tried between the starts next to the best one."""


@dataclass(frozen=True)
class ChaoticSearch:
    """Pairs with a chaotic effect among `effects` beside `base`, fitted to `measured`."""

    base: Hypothesis
    measured: Sequence[FloatArray]
    effects: Sequence[Effect]
    plain: Plain
    stochastic: StochasticSearch
    each: Each

    def partners(self, chaotic: Explanation) -> list[Explanation]:
        """The chaotic effect of `chaotic`, alone so far, with each of the most promising second effects.

        These are screened by their responses without the chaos: with it, any small change grows.
        """
        host, noise = chaotic.fit, chaotic.stochastic
        if noise is None or chaotic.display is not None or len(host.hypothesis.effects) != 1:
            return []
        calm = evaluated(self.base, self.measured, host.coordinates[: self.base.base_count], self.plain)
        screen = Screen(replace(calm, residuals=host.residuals), noise.whitener)
        others = [e for e in self.effects if e.label not in chaotic.labels and not e.chaotic]
        best = [candidates[0] for candidates in best_forms(self.each(screen.candidates, others))]
        return self.each(lambda c: self._joined(chaotic, c), best[:PARTNERS_TRIED])

    def beside(self, found: Sequence[Explanation]) -> list[Explanation]:
        """Each chaotic effect alone and beside the best single effects of `found`, under their slow noise."""
        hosts: dict[tuple[str, ...], Explanation] = {}
        for host in sorted(found, key=lambda e: -e.log_evidence):
            if host.drifts and not host.chaotic and len(host.fit.hypothesis.effects) < 2:
                hosts.setdefault(host.fit.hypothesis.labels, host)
        alone = [hosts.pop(())] if () in hosts else []
        tasks = [
            (host, effect)
            for host in [*alone, *list(hosts.values())[:HOSTS_TRIED]]
            for effect in self.effects
            if effect.chaotic and effect.label not in host.labels
        ]
        return self.each(lambda task: self._joined(task[0], self._start(*task)), tasks)

    def _start(self, host: Explanation, effect: Effect) -> Candidate:
        """`effect` at that of its starts, or of the places between it and the next, that leaves least under
        the noise of `host`."""
        hypothesis = host.fit.hypothesis.with_effect(effect)
        starts = np.array(effect.starts(hypothesis.scale))
        for _ in range(ROUNDS):
            left = self._left(host, hypothesis, starts)
            best = int(np.argmin(left))
            lower, upper = starts[max(best - 1, 0)], starts[min(best + 1, len(starts) - 1)]
            starts = np.concatenate([starts[[best]], np.geomspace(lower, upper, BETWEEN)])
        least = starts[np.argmin(self._left(host, hypothesis, starts))]
        return Candidate(effect, tuple(least), 0.0)

    def _left(self, host: Explanation, hypothesis: Hypothesis, starts: FloatArray) -> FloatArray:
        """Whitened squared error (n,) of `hypothesis` with its last effect at `starts` (n, parameters)."""
        values = np.column_stack([np.repeat(host.fit.values[None], len(starts), axis=0), starts])
        return square_errors(hypothesis, self.measured, host.fit.whitener, values)

    def _joined(self, host: Explanation, candidate: Candidate) -> Explanation:
        """`host` with one effect more, refitted under its noise."""
        return self.stochastic.moved(host, *joined(host.fit, [candidate]))
