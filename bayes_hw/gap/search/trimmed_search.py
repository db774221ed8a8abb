"""Effects and pairs of effects by least trimmed squares, and then on all of the records.

Where a likelihood has many peaks, plain least squares from the model as it is given ends on a wrong one;
least trimmed squares mostly does not (`bayes_hw.gap.fit.least_trimmed_squares`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.explanation import Explanation, with_coloured_noise
from bayes_hw.gap.fit.fit import Fit, fit, fitted_on
from bayes_hw.gap.fit.hypothesis import Candidate
from bayes_hw.gap.fit.joint_fits import MORE_ITERATIONS, cheapest_of_each, joined
from bayes_hw.gap.fit.least_trimmed_squares import best_stretches
from bayes_hw.gap.noise.whitener import Plain
from bayes_hw.gap.search.screen import Screen, best_forms, distinct
from bayes_hw.gap.simulate.parallel import Each

LEFT_OUT = 0.3
"""Share of the records' stretches that does not count at first."""

FIRST_ITERATIONS = 6
HOSTS = 3
PARTNER_LABELS = 7
SINGLES_SETTLED = 2
PAIRS_SETTLED = 5


@dataclass(frozen=True, eq=False)
class TrimmedSearch:
    """Fits of `effects` to `measured` from `origin`, the base model with its modes as given."""

    origin: Fit
    measured: Sequence[FloatArray]
    effects: Sequence[Effect]
    plain: Plain
    each: Each

    def run(self, forms: Sequence[Sequence[Candidate]]) -> list[Explanation]:
        """The best effects alone and the best pairs of them; `forms` are candidates of every effect."""
        own = [[c] for candidates in forms for c in distinct(candidates)]
        singles = self._trimmed([(self.origin, candidates) for candidates in own])
        starts = [start for host in singles[:HOSTS] for start in self._beside(host)]
        pairs = self._trimmed(starts)
        best = [*singles[:SINGLES_SETTLED], *pairs[:PAIRS_SETTLED]]
        return self.each(self._settled, best)

    def _trimmed(self, starts: Sequence[tuple[Fit, list[Candidate]]]) -> list[Fit]:
        """Every host with its candidates, the best of each combination of effects, best first."""
        begun = self.each(lambda start: self._begun(*start), starts)
        return cheapest_of_each([f for f in begun if np.isfinite(f.cost)])

    def _begun(self, host: Fit, candidates: Sequence[Candidate]) -> Fit:
        hypothesis, start = joined(host, candidates)
        return fit(hypothesis, self.measured, start, self.plain, FIRST_ITERATIONS, left_out=LEFT_OUT)

    def _beside(self, host: Fit) -> list[tuple[Fit, list[Candidate]]]:
        """The effects that promise most beside that of `host`, on the stretches that it fits best."""
        white = [self.plain.whiten(e[:, None], record) for record, e in enumerate(host.residuals)]
        worst = [~kept[:, 0] for kept in best_stretches(white, LEFT_OUT)]
        screen = Screen(host, self.plain.without(worst))
        others = [e for e in self.effects if e.label not in host.hypothesis.labels]
        forms = best_forms(self.each(screen.candidates, others))[:PARTNER_LABELS]
        return [(host, [c]) for candidates in forms for c in distinct(candidates)]

    def _settled(self, begun: Fit) -> Explanation:
        """The fit to all samples from where the stretches that fit best lead, under coloured noise."""
        trimmed = fitted_on(begun, self.measured, self.plain, MORE_ITERATIONS, LEFT_OUT)
        whole = fitted_on(trimmed, self.measured, self.plain, MORE_ITERATIONS)
        return with_coloured_noise(whole, self.measured)
