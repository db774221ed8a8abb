"""Effects and pairs of effects sought on the stretches of the records that fit best, and then on all of them.

Where a likelihood has many peaks, plain least squares from the model as it is given ends on a wrong one;
least trimmed squares mostly does not (`bayes_hw.gap.trimming`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.explanation import Explanation
from bayes_hw.gap.fit import Fit, fit, fitted_on
from bayes_hw.gap.joint_fits import MORE_ITERATIONS, JointFits, cheapest_of_each, joined
from bayes_hw.gap.screen import Candidate, Screen, best_forms, distinct
from bayes_hw.gap.trimming import best_stretches

LEFT_OUT = 0.3
"""Share of the records' stretches that does not count at first."""

FIRST_ITERATIONS = 6
HOSTS = 3
PARTNER_LABELS = 7
SINGLES_SETTLED = 2
PAIRS_SETTLED = 5


@dataclass(frozen=True, eq=False)
class TrimmedSearch:
    """Fits of `effects` from `origin`, the base model with its modes as given, to the records of `joint`."""

    origin: Fit
    effects: Sequence[Effect]
    joint: JointFits

    def run(self, forms: Sequence[Sequence[Candidate]]) -> list[Explanation]:
        """The best effects alone and the best pairs of them; `forms` are candidates of every effect."""
        own = [[c] for candidates in forms for c in distinct(candidates)]
        singles = self._trimmed([(self.origin, candidates) for candidates in own])
        starts = [start for host in singles[:HOSTS] for start in self._beside(host)]
        pairs = self._trimmed(starts)
        best = [*singles[:SINGLES_SETTLED], *pairs[:PAIRS_SETTLED]]
        return self._settled(best)

    def _trimmed(self, starts: Sequence[tuple[Fit, list[Candidate]]]) -> list[Fit]:
        """Every host with its candidates, the best of each combination of effects, best first."""
        begun = self.joint.each(lambda start: self._begun(*start), starts)
        return cheapest_of_each([f for f in begun if np.isfinite(f.cost)])

    def _begun(self, host: Fit, candidates: Sequence[Candidate]) -> Fit:
        joint = self.joint
        hypothesis, start = joined(host, candidates)
        return fit(hypothesis, joint.measured, start, joint.plain, FIRST_ITERATIONS, left_out=LEFT_OUT)

    def _beside(self, host: Fit) -> list[tuple[Fit, list[Candidate]]]:
        """The effects that promise most beside that of `host`, on the stretches that it fits best."""
        white = [self.joint.plain.whiten(e[:, None], record) for record, e in enumerate(host.residuals)]
        worst = [~kept[:, 0] for kept in best_stretches(white, LEFT_OUT)]
        screen = Screen(host, self.joint.plain.without(worst))
        others = [e for e in self.effects if e.label not in host.hypothesis.labels]
        forms = best_forms(self.joint.each(screen.candidates, others))[:PARTNER_LABELS]
        return [(host, [c]) for candidates in forms for c in distinct(candidates)]

    def _settled(self, begun: Sequence[Fit]) -> list[Explanation]:
        """The fits to all samples from where the stretches that fit best lead, under coloured noise."""
        joint = self.joint

        def on_all(f: Fit) -> Fit:
            trimmed = fitted_on(f, joint.measured, joint.plain, MORE_ITERATIONS, LEFT_OUT)
            return fitted_on(trimmed, joint.measured, joint.plain, 0)

        return joint.explained(cheapest_of_each(joint.finished(joint.each(on_all, begun))))
