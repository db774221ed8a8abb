"""Which effect: fits of the base, of every effect, of pairs, and of the stochastic effects beside them.

Every hypothesis is fitted on plain residuals first and under autoregressive noise after: with the base
misfit, a noise model fitted at once absorbs the effect, and the fit ends in a wrong minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.criticism.leftover import leaves_structure
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.candidate import Candidate
from bayes_hw.gap.fit.continuation import can_be_led, led, measured_positions
from bayes_hw.gap.fit.explanation import Explanation, is_far_ahead, repeats_far_ahead, with_coloured_noise
from bayes_hw.gap.fit.fit import Fit, fit, fitted_on
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.fit.joint_fits import FIRST_ITERATIONS, MORE_ITERATIONS, JointFits, cheapest_of_each
from bayes_hw.gap.noise.glitches import Glitches
from bayes_hw.gap.noise.whitener import Plain, only_read
from bayes_hw.gap.search.chaotic_search import ChaoticSearch
from bayes_hw.gap.search.contenders import (
    SLIGHT,
    best_of,
    hides,
    is_coloured,
    later,
    leaders,
    may_hide_a_cause,
    with_parts,
    worst_first,
    worth_refining,
)
from bayes_hw.gap.search.following import Following
from bayes_hw.gap.search.multistart import Restarts, drawn_about, nearest
from bayes_hw.gap.search.pair_search import PairSearch
from bayes_hw.gap.search.refinement import Refinement
from bayes_hw.gap.search.screen import Screen, distinct, most_promising
from bayes_hw.gap.search.short_periods import SHORT_KEPT, most_of_a_short_period, short_periods
from bayes_hw.gap.search.stochastic_search import StochasticSearch
from bayes_hw.gap.search.trimmed_search import TrimmedSearch
from bayes_hw.gap.simulate.parallel import Each

BASE_DRAWS = 80
BASE_STARTS = 4
SINGLES_KEPT = 6
TRIED_FROM_NOMINAL = 14
TRIED_FROM_BASE = 2
TRIED_WHERE_NOTHING_IS_LEFT = 3
SINGLES_FINISHED = 8

ROUNDED_LATER = 3
"""Effects found after the first ones that are held against a rounding encoder too."""

HIDING = 2
NEAR = 100.0
"""Log-evidence within which a second stochastic effect is held against every effect too."""

REFINED = 4
"""Single effects that are tried in forms of more parameters."""

RESTARTED = 3
LEADERS = 2
"""Labels of which the best fit is begun again near where it ended, before a second effect is sought."""


@dataclass(frozen=True)
class Attribution:
    """Everything fitted: the base and the explanations, best evidence first; the base fits of all starts."""

    base: Explanation
    explanations: tuple[Explanation, ...]
    base_costs: tuple[float, ...]
    singles: tuple[Fit, ...]

    @property
    def best(self) -> Explanation:
        return self.explanations[0]


class Attributor:
    """Fits hypotheses about one case; `jobs` threads, `effects` the catalogue.

    `found` are all explanations so far, `coloured` those of single effects under coloured noise, `singles`
    the plain fits of single effects, best first, `refined` those whose effects were tried in richer forms.
    `chosen` says which of them would be gone with: the best need not have earned its place.
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
        self._short_periods_known = False

    def run(self) -> Attribution:
        """All explanations of the case; the search goes on while the best of them leaves structure."""
        self.tell("base model")
        bases = self.base_fits()
        base = with_coloured_noise(bases[0], self.measured)
        self.found.append(base)
        structure = self.stochastic.lattice or self._unfinished
        self._seek_single_effects(bases[0], TRIED_FROM_NOMINAL if structure else TRIED_WHERE_NOTHING_IS_LEFT)
        hosts = list(self.coloured) if self.stochastic.lattice or self._unfinished else []
        self.tell("stochastic effects")
        noisy = self.stochastic.beside(base, hosts, self.singles if hosts else [])
        self.found += noisy + self.stochastic.two_at_once(base, noisy)
        if self._noise_hides_a_period:
            self._seek_short_periods(bases[0])
        if structure and self._goes_on:
            self._seek_richer_forms()
        if repeats_far_ahead(self.found):
            if self._unfinished:
                self.found += self._richer(worth_refining(self.found))
        elif structure:
            self._seek_further(bases[0])
        self._finish_best()
        if self.stochastic.lattice:
            self.found += self.stochastic.beside(base, later(self.found, hosts)[:ROUNDED_LATER], [])
        known = [e for e in self.found if np.isfinite(e.log_evidence) or e is base]
        everything = sorted(known, key=worst_first)
        return Attribution(base, tuple(everything), tuple(f.cost for f in bases), tuple(self.singles))

    def _seek_single_effects(self, base: Fit, tried: int) -> None:
        self.tell("single effects")
        self.singles = self.single_fits(base, tried)
        self.coloured = self._joint.explained(self.singles[:SINGLES_KEPT])
        self.found += self.coloured

    def _seek_richer_forms(self) -> None:
        """Of the best single effects."""
        self.tell("forms of more parameters")
        richer = self._richer(sorted(self.coloured, key=worst_first)[:REFINED])
        self.found += richer
        self.coloured += richer

    def _seek_further(self, base: Fit) -> None:
        """More single effects, pairs and chaotic motion, as long as structure is left."""
        if self._unfinished:
            self._follow_rugged_motion(base)
        if self._unfinished:
            self._lead_the_ripple()
        if not is_far_ahead(self.found) and self._unfinished:
            self.tell("pairs on the stretches that fit best")
            search = TrimmedSearch(self.nominal, self.measured, self.effects, self.plain, self.each)
            self.found += search.run(self._forms_at_nominal)
        if self._unfinished:
            self._refine_the_best()
        if self._unfinished:
            self._seek_other_starts(base)
        if not is_far_ahead(self.found) and self._goes_on:
            self._seek_pairs()
        if self._unfinished:
            self._seek_chaos()

    def _follow_rugged_motion(self, base: Fit) -> None:
        """A gap, or a spring that jumps, corrected by what is measured, and simulated freely from there."""
        self.tell("rugged motion followed")
        found = self._following.found([self.nominal, base], self.singles)
        free = self._joint.explained([self._following.set_free(e.fit) for e in found])
        self.found += found + free
        self.coloured += free

    def _lead_the_ripple(self) -> None:
        """From the measured position to the simulated one, where the best single effect is a ripple."""
        if not self.coloured:
            return
        best = min(self.coloured, key=worst_first).fit
        if can_be_led(best.hypothesis):
            positions = measured_positions(best)
            found = led(best.hypothesis, best.coordinates, positions, self.measured, self.plain)
            more = self._joint.explained([found])
            self.found += more
            self.coloured += more

    def _seek_other_starts(self, base: Fit) -> None:
        """Of single effects."""
        self._seek_short_periods(base)
        self.tell("other starts")
        leading = [e.fit for e in sorted(self.coloured, key=worst_first)][:RESTARTED]
        more = self._joint.explained(cheapest_of_each(self._restarts.elsewhere(leading)))
        more += self._near(leaders([*self.coloured, *more])[:LEADERS])
        self.found += more
        self.coloured += more

    def _seek_short_periods(self, base: Fit) -> None:
        if self._short_periods_known:
            return
        self._short_periods_known = True
        self.tell("short periods")
        short = short_periods(self.nominal, base, self.effects, self._joint)
        self.singles = cheapest_of_each([*self.singles, *short])
        more = self._joint.explained(short[:SHORT_KEPT])
        self.found += more
        self.coloured += more

    @property
    def _noise_hides_a_period(self) -> bool:
        """Whether slow noise explains everything, and yet an effect of a short period stands out of it."""
        best = best_of(self.found)
        noise = best.cause_of_noise
        if noise is None or noise.size is None or self._unfinished:
            return False
        screen = Screen(best.fit, noise.whitener)
        return most_of_a_short_period(screen, self.effects, self.each) > 2 * SLIGHT

    def _seek_pairs(self) -> None:
        self.tell("pairs of effects")
        firsts = [e.fit for e in sorted(self.coloured, key=worst_first)]
        self.found += self._under_noise() + self._pairs.first(firsts, self.singles)
        if may_hide_a_cause(self.found):
            self._seek_partners(firsts)
        if self._unfinished:
            self._refine_the_best()
        if self._unfinished:
            known = [e for e in self.found if e.stochastic is None and len(e.fit.hypothesis.effects) == 2]
            for pair in sorted(known, key=worst_first)[:1]:
                self.found += self._restarts.near(pair)

    def _refine_the_best(self) -> None:
        """The best explanations with their effects in forms of more parameters, and their parts."""
        best = [e for e in worth_refining(self.found) if not any(e is known for known in self.refined)]
        self.refined += best
        richer = self._richer(best)
        self.found += richer + self._pairs.parts(sorted(richer, key=worst_first)[:1])

    def _seek_partners(self, tried: Sequence[Fit]) -> None:
        """Pairs of the best single effect and of the best beside slow noise, which may stand for a second
        effect, where they are not among `tried`."""
        alone = [e for e in sorted(self.found, key=worst_first) if len(e.fit.hypothesis.effects) == 1]
        best = [next((e.fit for e in alone if kind(e)), None) for kind in (hides, is_coloured)]
        new = [f for f in best if f is not None and not any(f is host for host in tried)]
        self.found += [pair for f in new for pair in self._pairs.beside(f, self.singles)]

    def _seek_chaos(self) -> None:
        """Second effects beside motion that is lost in chaos, or chaos beside what is best otherwise."""
        self.tell("chaotic motion")
        search = ChaoticSearch(self.base, self.measured, self.effects, self.plain, self.stochastic, self.each)
        if not best_of(self.found).lost_motion:
            self.found += search.beside(self.found)
        best = best_of(self.found)
        if best.followed is not None:
            self.found += self._following.partners(best)
        elif best.lost_motion:
            self.found += search.partners(best)

    def _finish_best(self) -> None:
        """The best explanation and its parts from near where they ended, and chaos under slow noise."""
        self.found += self._apart(best_of(self.found))
        self.found += self._near(with_parts(self.found))
        for chaotic in [
            e for e in with_parts(self.found) if e.chaotic and e.stochastic is None and e.followed is None
        ]:
            noisy = self.stochastic.beside(chaotic, [], [])
            self.found += noisy + self.stochastic.two_at_once(chaotic, noisy)

    def _near(self, explanations: Sequence[Explanation]) -> list[Explanation]:
        """Each of `explanations` of different names begun again near where it ended."""
        return [e for found in self.each(self._restarts.near, explanations) for e in found]

    @property
    def _unfinished(self) -> bool:
        """Whether the best explanation leaves structure, or only base parameters far off make up for it, or
        the one leaves structure that would be chosen, since the best has not earned its place."""
        best = best_of(self.found)
        if best.strained or self._leaves_structure(best):
            return True
        chosen = self.chosen(self.found)
        return chosen is not best and self._leaves_structure(chosen)

    def _leaves_structure(self, explanation: Explanation) -> bool:
        """Whether `explanation` does, worked out when it is first asked for."""
        if explanation not in self._structured:
            self._structured[explanation] = leaves_structure(explanation, self.base.inputs)
        return self._structured[explanation]

    @property
    def _goes_on(self) -> bool:
        """Whether a further cause is to be sought, among effects that can be followed."""
        return may_hide_a_cause(self.found) or self._unfinished

    def _richer(self, explanations: Sequence[Explanation]) -> list[Explanation]:
        """Explanations with their effects in forms of more parameters."""
        return Refinement(self._at_nominal, self.measured, self.plain, self.stochastic, self.each).of(
            explanations
        )

    @cached_property
    def _restarts(self) -> Restarts:
        return Restarts(self.base, self.measured, self.plain, self.stochastic, self.each, self.seed)

    @cached_property
    def _following(self) -> Following:
        return Following(self.base, self.measured, self.effects, self.plain, self.each)

    @cached_property
    def _joint(self) -> JointFits:
        return JointFits(self.measured, self.plain, self.each)

    @cached_property
    def _pairs(self) -> PairSearch:
        return PairSearch(self.base, self._at_nominal, self.effects, self._joint, self._forms_at_nominal)

    def _under_noise(self) -> list[Explanation]:
        """Effects fitted under the best stochastic effects, which may hide them."""
        alone: dict[tuple[str, ...], Explanation] = {}
        for e in sorted(self.found, key=worst_first):
            if e.stochastic is not None and not e.fit.hypothesis.effects:
                alone.setdefault(e.labels, e)
        near = [
            e for e in alone.values() if e.log_evidence > max(x.log_evidence for x in alone.values()) - NEAR
        ]
        return [pair for e in near[:HIDING] for pair in self.stochastic.under(e, self.effects)]

    def base_fits(self) -> list[Fit]:
        """Base fits from the nominal model and from the best of many draws about it, best first."""
        starts = [self.base.prior_means, *self._draws[:BASE_STARTS]]
        fits = self.each(lambda start: fit(self.base, self.measured, start, self.plain), starts)
        best = min(fits, key=lambda f: f.cost)
        glitches = Glitches.of(best.residuals) if self.glitches_known else None
        if glitches is not None:
            self.plain = self.plain.without(glitches.masks)
            fits = [fitted_on(f, self.measured, self.plain) for f in fits]
        return sorted(fits, key=lambda f: f.cost)

    @cached_property
    def _draws(self) -> FloatArray:
        """Starts about the nominal model, what is roughly known of it drawn; the best first."""
        spreads, rng = self.base.builder.start_spreads, np.random.default_rng(self.seed)
        draws = drawn_about(self.base.prior_means, spreads, BASE_DRAWS, rng)
        return nearest(self.base, self.measured, self.plain, draws)

    def single_fits(self, base: Fit, tried_from_nominal: int = TRIED_FROM_NOMINAL) -> list[Fit]:
        """The best plain fit of the most promising effects, every form its own, best first.

        Each starts from the base fit and from the nominal model: a base that was fitted without the effect
        can have moved to where the effect no longer helps.
        """
        starts: list[tuple[Fit, list[Candidate]]] = []
        at_base = Screen(base, self.plain.widened(base.rmse))
        at_base_forms = self.each(at_base.candidates, self.effects)
        for origin, found, tried in (
            (self.nominal, self._forms_at_nominal, tried_from_nominal),
            (base, at_base_forms, TRIED_FROM_BASE),
        ):
            ranked = sorted((candidates for candidates in found if candidates), key=most_promising)
            for candidates in ranked[:tried]:
                starts += [(origin, [candidate]) for candidate in distinct(candidates)]
        return self._joint.in_two_rounds(starts, SINGLES_FINISHED)

    def _apart(self, best: Explanation) -> list[Explanation]:
        """The response of `best` without its noise and the noise without the response, both from where they
        were found together: either can have led the fit to where it needs the other no more."""
        found, noise = best.fit, best.stochastic
        if not found.hypothesis.effects or noise is None or best.display is not None:
            return []
        plain = fit(found.hypothesis, self.measured, found.coordinates, self.plain, MORE_ITERATIONS)
        alone = self.stochastic.moved(best, self.base, found.coordinates[: self.base.base_count])
        return [*self._joint.explained([plain]), alone]

    @cached_property
    def _at_nominal(self) -> Screen:
        """The screen of the nominal model, once its glitches are masked."""
        return Screen(self.nominal, self.plain.widened(self.nominal.rmse))

    @cached_property
    def _forms_at_nominal(self) -> list[list[Candidate]]:
        """Candidates of every effect, each best first, at the nominal model."""
        return self.each(self._at_nominal.candidates, self.effects)

    @cached_property
    def nominal(self) -> Fit:
        """The base model with its modes as given and the rest fitted."""
        rows = np.arange(self.base.base_count) < len(self.base.builder.start_spreads)
        starts = [self.base.prior_means, *self._draws[:BASE_STARTS]]
        fits = self.each(
            lambda start: fit(self.base, self.measured, start, self.plain, FIRST_ITERATIONS * 2, rows),
            starts,
        )
        return min(fits, key=lambda f: f.cost)
