"""Which effect: fits of the base, of every effect, of pairs, and of the stochastic effects beside them.

Every hypothesis is fitted on plain residuals first and under autoregressive noise after: with the base
misfit, a noise model fitted at once absorbs the effect, and the fit ends in a wrong minimum.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import TypeAlias, TypeVar

import numpy as np

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.effects.effect import Effect, PeriodicEffect
from bayes_hw.gap.explanation import Explanation, ShownHypothesis, with_coloured_noise, with_stochastic
from bayes_hw.gap.fit import Fit, fit
from bayes_hw.gap.hypothesis import Hypothesis
from bayes_hw.gap.screen import Candidate, Screen
from bayes_hw.gap.stochastic import (
    StochasticFit,
    autoregression,
    clock_jitter,
    held_samples,
    lattice_step,
    outliers,
    quantization,
    random_walk,
    wind,
)
from bayes_hw.gap.whitener import Plain

BASE_DRAWS = 80
BASE_STARTS = 4
SINGLES_KEPT = 6
PARTNERS_TRIED = 4
FIRST_EFFECTS = 2
PAIRS_KEPT = 5
JOINT_EFFECTS = 12
JOINT_STARTS = 6
PAIRS_PRUNED = 2
FIRST_ITERATIONS = 4
MORE_ITERATIONS = 10
TRIED_FROM_NOMINAL = 14
TRIED_FROM_BASE = 2
SINGLES_FINISHED = 8

SINGLES_WITH_NOISE = 12
LARGEST_WANDER = 1.3
"""Growth of the plain error at which a refit has left the record to the noise; it is not taken."""

WORTH_REFITTING = 3.0
WORTH_EVERY_EFFECT = 50.0
"""Gains of log-likelihood over autoregressive noise."""

Kind: TypeAlias = Callable[[Fit], StochasticFit | None]

Given = TypeVar("Given")
Made = TypeVar("Made")


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
    """Fits hypotheses about one case; `jobs` threads, `effects` the catalogue."""

    def __init__(
        self,
        base: Hypothesis,
        measured: Sequence[FloatArray],
        effects: Sequence[Effect],
        stochastic_labels: frozenset[str],
        rng: np.random.Generator,
        jobs: int = 1,
        tell: Callable[[str], None] = lambda _: None,
    ) -> None:
        self.base, self.measured, self.effects = base, measured, effects
        self.stochastic_labels = stochastic_labels
        self.seed, self.jobs, self.tell = int(rng.integers(2**31)), jobs, tell
        self.plain = Plain(base.scale.sigma)

    def run(self) -> Attribution:
        """All explanations of the case."""
        self.tell("base model")
        bases = self.base_fits()
        base = with_coloured_noise(bases[0], self.measured)
        self.tell("single effects")
        singles = self.single_fits(bases[0])
        coloured = self._each(lambda f: with_coloured_noise(f, self.measured), singles[:SINGLES_KEPT])
        self.tell("pairs of effects")
        firsts = [e.fit for e in sorted(coloured, key=_worst_first)[:FIRST_EFFECTS]]
        pairs = self.pair_fits(firsts, singles)
        paired = self._each(lambda f: with_coloured_noise(f, self.measured), pairs[:PAIRS_KEPT])
        coloured += paired
        coloured += self._each(
            self._without_one, self._parts(sorted(paired, key=_worst_first)[:PAIRS_PRUNED])
        )
        self.tell("stochastic effects")
        found = self.stochastic_explanations(base, coloured, singles)
        everything = sorted([base, *coloured, *found], key=_worst_first)
        return Attribution(base, tuple(everything), tuple(f.cost for f in bases), tuple(singles))

    def _each(self, work: Callable[[Given], Made], items: Sequence[Given]) -> list[Made]:
        def quietly(item: Given) -> Made:
            """Trial parameters may overflow; such trials have no finite cost and are not taken."""
            with np.errstate(all="ignore"):
                return work(item)

        if self.jobs == 1:
            return [quietly(item) for item in items]
        with ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(quietly, items))

    def base_fits(self) -> list[Fit]:
        """Base fits from the nominal model and from the best of many draws about it, best first."""
        starts = [self.base.prior_means, *self._draws[:BASE_STARTS]]
        fits = self._each(lambda start: fit(self.base, self.measured, start, self.plain), starts)
        return sorted(fits, key=lambda f: f.cost)

    @cached_property
    def _draws(self) -> FloatArray:
        """Starts about the nominal model, what is roughly known of it drawn; the best first."""
        means, spreads = self.base.prior_means, self.base.builder.start_spreads
        draws = np.repeat(means[None], BASE_DRAWS, axis=0)
        rng = np.random.default_rng(self.seed)
        draws[:, : len(spreads)] += rng.normal(size=(BASE_DRAWS, len(spreads))) * spreads
        simulated = self.base.simulate_batch(self.base.to_values(draws))
        errors = [
            np.sum((y[:, None] - s) ** 2, axis=0) for y, s in zip(self.measured, simulated, strict=True)
        ]
        return np.asarray(draws[np.argsort(np.sum(errors, axis=0))])

    def single_fits(self, base: Fit) -> list[Fit]:
        """The best plain fit of every form of every effect, best first.

        Each starts from the base fit and from the nominal model: a base that was fitted without the effect
        can have moved to where the effect no longer helps.
        """
        starts: list[tuple[Fit, list[Candidate]]] = []
        for origin, tried in ((self.nominal, TRIED_FROM_NOMINAL), (base, TRIED_FROM_BASE)):
            screen = Screen(origin, Plain(max(origin.rmse, self.plain.sigma)))
            ranked = sorted(
                (c for c in self._each(screen.candidates, self.effects) if c), key=_most_promising
            )
            for forms in ranked[:tried]:
                starts += [(origin, [candidate]) for candidate in forms[: forms[0].effect.starts_tried]]
        return self._in_two_rounds(starts, SINGLES_FINISHED)

    def _in_two_rounds(self, starts: Sequence[tuple[Fit, list[Candidate]]], finished: int) -> list[Fit]:
        """A few iterations of every joint fit, then more of the best `finished`; best first."""
        begun = self._each(lambda pair: self._begun(*pair), starts)
        first = sorted(begun, key=lambda f: f.cost)
        done = self._each(
            lambda f: fit(f.hypothesis, self.measured, f.coordinates, self.plain, MORE_ITERATIONS),
            first[:finished],
        )
        return _best_of_each([*done, *first[finished:]])

    def _begun(self, host: Fit, candidates: Sequence[Candidate]) -> Fit:
        hypothesis, values = host.hypothesis, host.values
        for candidate in candidates:
            hypothesis = hypothesis.with_effect(candidate.effect)
            values = np.concatenate([values, candidate.values])
        start = hypothesis.to_coordinates(values)
        return fit(hypothesis, self.measured, start, self.plain, FIRST_ITERATIONS)

    def pair_fits(self, firsts: Sequence[Fit], singles: Sequence[Fit]) -> list[Fit]:
        """Joint plain fits of two effects, from the nominal modes and from the best single effects.

        From the nominal modes those pairs start whose responses promise most together: the second effect of a
        greedy choice is lost where the first has bent the base model to stand for both.
        """
        starts: list[tuple[Fit, list[Candidate]]] = []
        origin = Screen(self.nominal, Plain(max(self.nominal.rmse, self.plain.sigma)))
        own = [(f, candidate_of(f)) for f in singles[:JOINT_EFFECTS]]
        responses = self._each(lambda one: origin.response(one[1]), own)
        promised = []
        for i, j in combinations(range(len(own)), 2):
            if own[i][1].effect.label != own[j][1].effect.label:
                both = np.stack([responses[i], responses[j]], axis=1)
                promised.append((origin.reduction(both), [own[i][1], own[j][1]]))
        promised.sort(key=lambda pair: -pair[0])
        starts += [(self.nominal, pair) for _, pair in promised[:JOINT_STARTS]]
        for first in firsts:
            screen = Screen(first, Plain(max(first.rmse, 1e-12)))

            def beside(other: Fit, first: Fit = first, screen: Screen = screen) -> list[Candidate]:
                candidate = candidate_of(other)
                if candidate.effect.label in first.hypothesis.labels:
                    return []
                found = screen.tried(candidate.effect, [candidate.values])
                if isinstance(candidate.effect, PeriodicEffect):
                    found += screen.candidates(candidate.effect)
                return found

            ranked = [max(c, key=lambda c: c.reduction) for c in self._each(beside, singles) if c]
            ranked.sort(key=lambda c: -c.reduction)
            starts += [(first, [candidate]) for candidate in ranked[:PARTNERS_TRIED]]
        return self._in_two_rounds(starts, PAIRS_KEPT)

    def _parts(self, pairs: Sequence[Explanation]) -> list[tuple[Fit, int]]:
        """Every pair with the number of the effect to keep."""
        return [(pair.fit, kept) for pair in pairs for kept in range(len(pair.fit.hypothesis.effects))]

    def _without_one(self, part: tuple[Fit, int]) -> Explanation:
        """One effect of a pair alone, from where the pair found it: a single fit may miss that minimum."""
        pair, kept = part
        hypothesis = self.base.with_effect(pair.hypothesis.effects[kept])
        own = pair.coordinates[pair.hypothesis.effect_rows[kept]]
        start = np.concatenate([pair.coordinates[: self.base.base_count], own])
        return with_coloured_noise(fit(hypothesis, self.measured, start, self.plain), self.measured)

    def stochastic_explanations(
        self, base: Explanation, coloured: Sequence[Explanation], singles: Sequence[Fit]
    ) -> list[Explanation]:
        """The stochastic effects alone and beside single effects, the response refitted under each.

        One that helps much anywhere is held against every single effect, since it may hide which is right.
        """
        best = sorted((e for e in coloured if len(e.labels) == 1), key=_worst_first)
        hosts = [base.fit, *(e.fit for e in (best if self.rounded else best[:FIRST_EFFECTS]))]
        noise = [autoregression(host).log_likelihood for host in hosts]
        tasks = [(kind, host) for kind in self._kinds() for host in range(len(hosts))]
        first = self._each(lambda task: task[0](hosts[task[1]]), tasks)
        chosen: list[tuple[Kind, StochasticFit, Fit]] = []
        helpful: list[Kind] = []
        for (kind, host), found in zip(tasks, first, strict=True):
            if found is None or found.label in hosts[host].hypothesis.labels:
                continue
            gain = found.log_likelihood - noise[host]
            if gain > WORTH_REFITTING or self.rounded:
                chosen.append((kind, found, hosts[host]))
            if gain > WORTH_EVERY_EFFECT and not self.rounded and kind not in helpful:
                helpful.append(kind)
        for kind in helpful:
            others = [f for f in singles if not any(f is host for host in hosts)][:SINGLES_WITH_NOISE]
            tried = list(zip(self._each(kind, others), others, strict=True))
            promising = [(found, f) for found, f in tried if found and found.label not in f.hypothesis.labels]
            promising.sort(key=lambda pair: -pair[0].log_likelihood)
            chosen += [(kind, found, f) for found, f in promising[:FIRST_EFFECTS]]
        return self._each(lambda choice: self._refitted(*choice), chosen)

    def _kinds(self) -> list[Kind]:
        if self.rounded:
            return [self._quantization]
        kinds: dict[Kind, str] = {
            outliers: "outliers",
            clock_jitter: "timing_jitter",
            held_samples: "timing_jitter",
            wind: "wind",
            random_walk: "sensor_drift",
        }
        return [kind for kind, label in kinds.items() if label in self.stochastic_labels]

    @cached_property
    def rounded(self) -> bool:
        """Whether the records lie on a lattice well above the noise: a fact, no hypothesis."""
        known = "encoder_quantization" in self.stochastic_labels
        return known and lattice_step(self.measured) > 0 and self._quantization(self.nominal) is not None

    def _quantization(self, host: Fit) -> StochasticFit | None:
        return quantization(host, self.base.scale.sigma)

    @cached_property
    def nominal(self) -> Fit:
        """The base model with its modes as given and the rest fitted."""
        rows = np.arange(self.base.base_count) < len(self.base.builder.start_spreads)
        starts = [self.base.prior_means, *self._draws[:BASE_STARTS]]
        fits = self._each(
            lambda start: fit(self.base, self.measured, start, self.plain, FIRST_ITERATIONS * 2, rows),
            starts,
        )
        return min(fits, key=lambda f: f.cost)

    def _refitted(self, kind: Kind, first: StochasticFit, host: Fit) -> Explanation:
        best = with_stochastic(first, host)
        current, stochastic = host, first
        for _ in range(2):
            hypothesis = current.hypothesis
            if stochastic.display is not None:
                hypothesis = ShownHypothesis.of(hypothesis, stochastic.display)
            moved = fit(hypothesis, self.measured, current.coordinates, stochastic.whitener, 5)
            plain = Hypothesis(hypothesis.builder, hypothesis.scale, hypothesis.inputs, hypothesis.effects)
            shown = plain.simulate(moved.values)
            residuals = [y - s for y, s in zip(self.measured, shown, strict=True)]
            current = Fit(
                plain, moved.coordinates, residuals, shown, moved.jacobians, stochastic.whitener, moved.cost
            )
            again = kind(current)
            if again is None:
                break
            stochastic = again
            trial = with_stochastic(stochastic, current)
            wandered = current.rmse > LARGEST_WANDER * host.rmse
            if wandered or trial.log_evidence < best.log_evidence + 1:
                break
            best = trial
        return best


def candidate_of(single: Fit) -> Candidate:
    """The effect of a single fit at its estimate."""
    count = single.hypothesis.base_count
    return Candidate(single.hypothesis.effects[-1], tuple(single.values[count:]), 0.0)


def _best_of_each(fits: Sequence[Fit]) -> list[Fit]:
    """The cheapest fit of every combination of effects, best first."""
    best: dict[frozenset[str], Fit] = {}
    for f in fits:
        key = frozenset(effect.name for effect in f.hypothesis.effects)
        if key not in best or f.cost < best[key].cost:
            best[key] = f
    return sorted(best.values(), key=lambda f: f.cost)


def _most_promising(candidates: Sequence[Candidate]) -> float:
    return -candidates[0].reduction


def _worst_first(explanation: Explanation) -> float:
    return -explanation.log_evidence
