"""Two effects at once: which pairs to fit jointly, and what each of the two explains alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np

from bayes_hw.gap.effects.effect import Effect, everywhere_periodic
from bayes_hw.gap.fit.explanation import Explanation
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.fit.hypothesis import Candidate, Hypothesis
from bayes_hw.gap.fit.joint_fits import JointFits, candidate_of, cheapest_of_each, part_of
from bayes_hw.gap.search.joint_screen import promising_pairs
from bayes_hw.gap.search.screen import Screen, best_forms, distinct

FIRST_EFFECTS = 2
PARTNERS_TRIED = 4
LABELS_BESIDE = 7
JOINT_EFFECTS = 12
JOINT_STARTS = 6
JOINTLY_SCREENED = 12
PAIRS_KEPT = 5
PAIRS_PRUNED = 2

PARTNERS_OF_ONE = 6
FINE_PARTNERS = 2


@dataclass(frozen=True, eq=False)
class PairSearch:
    """Pairs of `effects` beside `base`, screened from `origin`, the base model with its modes as given.

    Joint fits begin there too: the second effect of a greedy choice is lost where the first has bent the base
    model to stand for both.
    """

    base: Hypothesis
    origin: Screen
    effects: Sequence[Effect]
    joint: JointFits
    forms: Sequence[Sequence[Candidate]]
    """Candidates of every effect at `origin`."""

    def first(self, firsts: Sequence[Fit], singles: Sequence[Fit]) -> list[Explanation]:
        """The most promising pairs of `singles`, and the best of `firsts` with partners from all effects."""
        starts = self._promising(singles)[:JOINT_STARTS]
        starts += self._together()
        for host in firsts[:FIRST_EFFECTS]:
            starts += self._beside(self._at(host), singles, PARTNERS_TRIED) + self._afresh(host)
        return self._explained(self.joint.in_two_rounds(starts, PAIRS_KEPT)[:PAIRS_KEPT])

    def beside(self, host: Fit, singles: Sequence[Fit]) -> list[Explanation]:
        """The best partners of one effect more."""
        screen = self._at(host)
        starts = self._beside(screen, singles, PARTNERS_OF_ONE) + self._afresh(host) + self._finely(screen)
        return self._explained(self.joint.in_two_rounds(starts, PAIRS_KEPT)[:PAIRS_KEPT])

    def parts(self, pairs: Sequence[Explanation]) -> list[Explanation]:
        """Every effect of every pair alone."""
        parts = [(pair.fit, kept) for pair in pairs for kept in range(len(pair.fit.hypothesis.effects))]
        return self.joint.explained(self.joint.each(self._without_one, parts))

    def _promising(self, singles: Sequence[Fit]) -> list[tuple[Fit, list[Candidate]]]:
        """Pairs whose responses promise most together, from the nominal modes, best first."""
        own = [candidate_of(single) for single in singles[:JOINT_EFFECTS]]
        responses = self.joint.each(self.origin.response, own)
        promised = []
        for i, j in combinations(range(len(own)), 2):
            if own[i].effect.label != own[j].effect.label:
                both = np.stack([responses[i], responses[j]], axis=1)
                promised.append((self.origin.reduction(both), [own[i], own[j]]))
        promised.sort(key=lambda pair: -pair[0])
        return [(self.origin.base, pair) for _, pair in promised]

    def _at(self, host: Fit) -> Screen:
        """The screen of a fit under white noise."""
        return Screen(host, self.joint.plain.widened(host.rmse))

    def _beside(
        self, screen: Screen, singles: Sequence[Fit], partners: int
    ) -> list[tuple[Fit, list[Candidate]]]:
        """The `partners` of most promise beside the host of `screen`, from its own estimate."""
        host = screen.base

        def beside(other: Fit) -> list[Candidate]:
            candidate = candidate_of(other)
            if candidate.effect.label in host.hypothesis.labels:
                return []
            found = screen.tried(candidate.effect, [candidate.values])
            if candidate.effect.periodic is not None:
                found += screen.candidates(candidate.effect)
            return found

        best = _best_candidates(self.joint.each(beside, singles))[:partners]
        return [(host, [candidate]) for candidate in best]

    def _finely(self, screen: Screen) -> list[tuple[Fit, list[Candidate]]]:
        """The best partners periodic in position, of periods down to what the samples can follow."""
        host = screen.base
        others = [e for e in self.effects if e.label not in host.hypothesis.labels]
        periodic = everywhere_periodic(others)
        found = self.joint.each(partial(screen.candidates, finely=True), periodic)
        return [(host, [candidate]) for candidate in _best_candidates(found)[:FINE_PARTNERS]]

    def _afresh(self, host: Fit) -> list[tuple[Fit, list[Candidate]]]:
        """All effects screened for what they promise beside that of `host`, from the nominal modes."""
        own = candidate_of(host)
        bare = self.origin.beside(self.origin.response(own))
        others = [e for e in self.effects if e.label != own.effect.label]
        forms = best_forms(self.joint.each(bare.candidates, others))[:LABELS_BESIDE]
        return [(self.origin.base, [own, c]) for candidates in forms for c in distinct(candidates)]

    def _together(self) -> list[tuple[Fit, list[Candidate]]]:
        """The pairs whose candidates promise most together, from the nominal modes."""
        pairs = promising_pairs(self.origin, self.forms, self.joint.each)[:JOINTLY_SCREENED]
        return [(self.origin.base, pair) for _, pair in pairs]

    def _explained(self, fitted: Sequence[Fit]) -> list[Explanation]:
        """The pairs under coloured noise, and the parts of the very best."""
        pairs = cheapest_of_each(fitted)
        paired = self.joint.explained(pairs)
        best = sorted(paired, key=lambda e: -e.log_evidence)[:PAIRS_PRUNED]
        return paired + self.parts(best)

    def _without_one(self, part: tuple[Fit, int]) -> Fit:
        """One effect of a pair alone, from where the pair found it: a single fit may miss that minimum."""
        pair, kept = part
        hypothesis, start = part_of(pair, kept, self.base)
        return fit(hypothesis, self.joint.measured, start, self.joint.plain)


def _best_candidates(found: Sequence[Sequence[Candidate]]) -> list[Candidate]:
    """The most promising candidate of every effect that has any, best first."""
    best = [max(candidates, key=lambda c: c.reduction) for candidates in found if candidates]
    return sorted(best, key=lambda c: -c.reduction)
