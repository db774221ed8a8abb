"""What a search knows of a case: the fits and explanations so far, and what any strategy may ask of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.residual_diagnostics import leaves_structure
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.explanation import Explanation, repeats_far_ahead, with_coloured_noise
from bayes_hw.gap.fit.fit import Fit, fit, fitted_on
from bayes_hw.gap.fit.hypothesis import Candidate, Hypothesis
from bayes_hw.gap.fit.joint_fits import FIRST_ITERATIONS, JointFits
from bayes_hw.gap.noise.glitches import Glitches
from bayes_hw.gap.noise.whitener import Plain, only_read
from bayes_hw.gap.search.candidate_models import (
    best_of,
    may_hide_a_cause,
)
from bayes_hw.gap.search.following import Following
from bayes_hw.gap.search.multistart import Restarts, drawn_about, nearest
from bayes_hw.gap.search.pair_search import PairSearch
from bayes_hw.gap.search.refinement import Refinement
from bayes_hw.gap.search.screen import Screen, distinct, most_promising
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.simulate.parallel import Each

BASE_DRAWS = 80
BASE_STARTS = 4
TRIED_FROM_BASE = 2
SINGLES_FINISHED = 8


class Search:
    """What is known of one case while it is sought for; `jobs` threads, `effects` the catalogue.

    `found` are all explanations so far, `coloured` those of single effects under coloured noise, `singles`
    the plain fits of single effects, best first, `refined` those whose effects were tried in richer forms.
    `chosen` says which of them would be gone with: the best need not have earned its place. `structure` says
    whether the base model leaves any, `first_hosts` are the effects that random causes were tried beside.
    """

    def __init__(
        self,
        base: Hypothesis,
        measured: Sequence[FloatArray],
        effects: Sequence[Effect],
        stochastic_labels: frozenset[str],
        rng: np.random.Generator,
        jobs: int = 1,
        tell: Callable[[str], None] = lambda _: None,
        chosen: Callable[[Sequence[Explanation]], Explanation] = best_of,
    ) -> None:
        self.base, self.measured, self.effects, self.chosen = base, measured, effects, chosen
        self.seed, self.each, self.tell = int(rng.integers(2**31)), Each(jobs), tell
        self.plain = Plain(base.scale.sigma, masked=base.unread or ())
        self.glitches_known = "outliers" in stochastic_labels
        read = only_read(measured, base.unread)
        self.stochastic = StochasticSearch(measured, stochastic_labels, base.scale.sigma, self.each, read)
        self.found: list[Explanation] = []
        self.coloured: list[Explanation] = []
        self.singles: list[Fit] = []
        self.refined: list[Explanation] = []
        self._structured: dict[Explanation, bool] = {}
        self.first_hosts: list[Explanation] = []
        self.structure = True
        self.short_periods_known = False

    def base_fits(self) -> list[Fit]:
        """Base fits from the nominal model and from the best of many draws about it, best first."""
        starts = [self.base.prior_means, *self.draws[:BASE_STARTS]]
        fits = self.each(lambda start: fit(self.base, self.measured, start, self.plain), starts)
        best = min(fits, key=lambda f: f.cost)
        glitches = Glitches.of(best.residuals) if self.glitches_known else None
        if glitches is not None:
            self.plain = self.plain.without(glitches.masks)
            fits = [fitted_on(f, self.measured, self.plain) for f in fits]
        return sorted(fits, key=lambda f: f.cost)

    def single_fits(self, base: Fit, tried_from_nominal: int) -> list[Fit]:
        """The best plain fit of the most promising effects, every form its own, best first.

        Each starts from the base fit and from the nominal model: a base that was fitted without the effect
        can have moved to where the effect no longer helps.
        """
        starts: list[tuple[Fit, list[Candidate]]] = []
        at_base = Screen(base, self.plain.widened(base.rmse))
        at_base_forms = self.each(at_base.candidates, self.effects)
        for origin, found, tried in (
            (self.nominal, self.forms_at_nominal, tried_from_nominal),
            (base, at_base_forms, TRIED_FROM_BASE),
        ):
            ranked = sorted((candidates for candidates in found if candidates), key=most_promising)
            for candidates in ranked[:tried]:
                starts += [(origin, [candidate]) for candidate in distinct(candidates)]
        return self.joint.in_two_rounds(starts, SINGLES_FINISHED)

    def begin(self) -> None:
        """Fit the base model alone, and see whether it leaves structure."""
        self.found.append(self.base_alone)
        self.structure = self.stochastic.lattice or self.unfinished

    @cached_property
    def repeats_explain(self) -> bool:
        """Whether repeated samples explain nearly all, of what is found when this is first asked."""
        return repeats_far_ahead(self.found)

    @cached_property
    def bases(self) -> list[Fit]:
        """Base fits of all starts, best first."""
        return self.base_fits()

    @cached_property
    def base_alone(self) -> Explanation:
        """The base model without an effect."""
        return with_coloured_noise(self.bases[0], self.measured)

    @property
    def best(self) -> Explanation:
        """Of what is found so far."""
        return best_of(self.found)

    def add_single_effects(self, explanations: Sequence[Explanation]) -> None:
        """Keep explanations by one effect each."""
        self.found += explanations
        self.coloured += explanations

    @property
    def unfinished(self) -> bool:
        """Whether the best explanation leaves structure, or only base parameters far off make up for it, or
        the one leaves structure that would be chosen, since the best has not earned its place."""
        best = best_of(self.found)
        if best.at_odds_with_prior or self._leaves_structure(best):
            return True
        chosen = self.chosen(self.found)
        return chosen is not best and self._leaves_structure(chosen)

    def _leaves_structure(self, explanation: Explanation) -> bool:
        """Whether `explanation` does, worked out when it is first asked for."""
        if explanation not in self._structured:
            self._structured[explanation] = leaves_structure(explanation, self.base.commands)
        return self._structured[explanation]

    @property
    def goes_on(self) -> bool:
        """Whether a further cause is to be sought, among effects that can be followed."""
        return may_hide_a_cause(self.found) or self.unfinished

    def near(self, explanations: Sequence[Explanation]) -> list[Explanation]:
        """Each of `explanations` of different names begun again near where it ended."""
        return [e for found in self.each(self.multistart.near, explanations) for e in found]

    def richer(self, explanations: Sequence[Explanation]) -> list[Explanation]:
        """Explanations with their effects in forms of more parameters."""
        return Refinement(self.at_nominal, self.measured, self.plain, self.stochastic, self.each).of(
            explanations
        )

    @cached_property
    def multistart(self) -> Restarts:
        return Restarts(self.base, self.measured, self.plain, self.stochastic, self.each, self.seed)

    @cached_property
    def following(self) -> Following:
        return Following(self.base, self.measured, self.effects, self.plain, self.each)

    @cached_property
    def joint(self) -> JointFits:
        return JointFits(self.measured, self.plain, self.each)

    @cached_property
    def pairs(self) -> PairSearch:
        return PairSearch(self.base, self.at_nominal, self.effects, self.joint, self.forms_at_nominal)

    @cached_property
    def draws(self) -> FloatArray:
        """Starts about the nominal model, what is roughly known of it drawn; the best first."""
        spreads, rng = self.base.builder.start_spreads, np.random.default_rng(self.seed)
        draws = drawn_about(self.base.prior_means, spreads, BASE_DRAWS, rng)
        return nearest(self.base, self.measured, self.plain, draws)

    @cached_property
    def at_nominal(self) -> Screen:
        """The screen of the nominal model, once its glitches are masked."""
        return Screen(self.nominal, self.plain.widened(self.nominal.rmse))

    @cached_property
    def forms_at_nominal(self) -> list[list[Candidate]]:
        """Candidates of every effect, each best first, at the nominal model."""
        return self.each(self.at_nominal.candidates, self.effects)

    @cached_property
    def nominal(self) -> Fit:
        """The base model with its modes as given and the rest fitted."""
        rows = np.arange(self.base.base_count) < len(self.base.builder.start_spreads)
        starts = [self.base.prior_means, *self.draws[:BASE_STARTS]]
        fits = self.each(
            lambda start: fit(self.base, self.measured, start, self.plain, FIRST_ITERATIONS * 2, rows),
            starts,
        )
        return min(fits, key=lambda f: f.cost)
