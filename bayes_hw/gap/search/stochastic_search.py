"""The stochastic effects alone and beside effects of the response, the response refitted under each."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from types import MappingProxyType

from bayes_hw.arrays import FloatArray
from bayes_hw.gap.case.lattice import lattice_step
from bayes_hw.gap.effects.effect import Effect
from bayes_hw.gap.fit.explanation import Explanation, ShownHypothesis, with_stochastic
from bayes_hw.gap.fit.fit import Fit, fit
from bayes_hw.gap.fit.hypothesis import Hypothesis
from bayes_hw.gap.fit.joint_fits import joined
from bayes_hw.gap.noise.kinds import ONE_CAUSE, TWO_CAUSES, FitNoise
from bayes_hw.gap.noise.random_cause import JITTER, ROUNDING
from bayes_hw.gap.noise.rounding import is_rounded, quantization
from bayes_hw.gap.noise.stochastic_fit import StochasticFit, autoregression
from bayes_hw.gap.noise.whitener import Whitener
from bayes_hw.gap.search.screen import Screen, best_forms
from bayes_hw.gap.simulate.parallel import Each

HOSTS = 2
SINGLES_WITH_NOISE = 12
FITTED_WITH_NOISE = 4
SCREENED_UNDER_NOISE = 8
FINISHED_UNDER_NOISE = 4
ITERATIONS_AT_FIRST = 3
ITERATIONS_UNDER_NOISE = 8

LARGEST_WANDER = 1.3
"""Growth of the plain error at which a refit has left the record to the noise; it is not taken."""

WORTH_REFITTING = 3.0
WORTH_EVERY_EFFECT = 50.0
"""Gains of log-likelihood over autoregressive noise."""

OF_KEY: Mapping[tuple[str, str], FitNoise] = MappingProxyType(
    {kind.key: kind.fit for kind in (*ONE_CAUSE, *TWO_CAUSES)}
)


class StochasticSearch:
    """Stochastic effects on the records `measured`, of which `read` are the samples that were, those of
    `labels`; `sigma` the noise to start with."""

    def __init__(
        self,
        measured: Sequence[FloatArray],
        labels: frozenset[str],
        sigma: float,
        each: Each,
        read: Sequence[FloatArray] | None = None,
    ) -> None:
        self.measured, self.labels, self.sigma, self.each = measured, labels, sigma, each
        self.read = measured if read is None else read

    @cached_property
    def lattice(self) -> bool:
        """Whether the records lie on a lattice, and rounding is in the catalogue."""
        return ROUNDING in self.labels and lattice_step(self.read) > 0

    def rounded(self, host: Fit) -> bool:
        """Whether the records lie on a lattice well above the noise: a fact, no hypothesis."""
        return self.lattice and is_rounded(host, self.sigma)

    def beside(
        self, base: Explanation, coloured: Sequence[Explanation], singles: Sequence[Fit]
    ) -> list[Explanation]:
        """Every stochastic effect beside `base` and beside the best of `coloured`, single effects.

        One that helps much anywhere is held against every plain fit of `singles`, since it may hide which of
        them is right.
        """
        rounded = self.rounded(base.fit)
        best = sorted((e for e in coloured if len(e.labels) == 1), key=lambda e: -e.log_evidence)
        hosts = [base.fit, *(e.fit for e in (best if rounded else best[:HOSTS]))]
        noise = [autoregression(host).log_likelihood for host in hosts]
        tasks = [(kind, host) for kind in self.kinds(rounded) for host in range(len(hosts))]
        first = self.each(lambda task: task[0](hosts[task[1]]), tasks)
        chosen: list[tuple[FitNoise, StochasticFit, Fit]] = []
        helpful: list[FitNoise] = []
        for (kind, host), found in zip(tasks, first, strict=True):
            if found is None or found.label in hosts[host].hypothesis.labels:
                continue
            gain = found.log_likelihood - noise[host]
            if gain > WORTH_REFITTING or rounded:
                chosen.append((kind, found, hosts[host]))
            if gain > WORTH_EVERY_EFFECT and not rounded and kind not in helpful:
                helpful.append(kind)
        for kind in helpful:
            others = [f for f in singles if not any(f is host for host in hosts)][:SINGLES_WITH_NOISE]
            alike = [found for (k, _), found in zip(tasks, first, strict=True) if k is kind and found]
            others = _likeliest(others, max(alike, key=lambda found: found.log_likelihood).whitener)
            tried = list(zip(self.each(kind, others), others, strict=True))
            promising = [(found, f) for found, f in tried if found and found.label not in f.hypothesis.labels]
            promising.sort(key=lambda pair: -pair[0].log_likelihood)
            chosen += [(kind, found, f) for found, f in promising[:HOSTS]]
        return self.each(lambda choice: self._refitted(*choice), chosen)

    def kinds(self, rounded: bool) -> list[FitNoise]:
        """The stochastic effects to try."""
        if rounded:
            return [self._quantization]
        return [kind.fit for kind in ONE_CAUSE if kind.cause.label in self.labels]

    def two_at_once(self, host: Explanation, noisy: Sequence[Explanation]) -> list[Explanation]:
        """Two stochastic effects at once beside the response of `host`, those of one being in `noisy`.

        Clock jitter is tried beside slow noise that helps alone, rounding where the records are rounded.
        """
        rounded = self.rounded(host.fit)
        alone = [e for e in noisy if e.fit.hypothesis.effects == host.fit.hypothesis.effects]
        reached = (
            max((e.log_evidence for e in alone if e.rounded), default=host.log_evidence)
            + WORTH_EVERY_EFFECT * rounded
        )
        helpful = {
            label
            for e in alone
            if e.stochastic is not None and e.log_evidence > host.log_evidence + WORTH_EVERY_EFFECT
            for label in e.stochastic.labels
        }
        kinds = self._both_kinds(rounded, helpful)
        first = self.each(lambda kind: kind(host.fit), kinds)
        worth = [
            (kind, found)
            for kind, found in zip(kinds, first, strict=True)
            if found is not None and with_stochastic(found, host.fit).log_evidence > reached
        ]
        return self.each(lambda pair: self._refitted(*pair, host.fit), worth)

    def _both_kinds(self, rounded: bool, helpful: Collection[str]) -> list[FitNoise]:
        """Of two stochastic effects; `helpful` are labels of those that help alone."""
        chosen = []
        for kind in TWO_CAUSES:
            known = {kind.cause.label, kind.second} <= self.labels and rounded == (kind.second == ROUNDING)
            if known and (kind.cause.label in helpful or kind.second != JITTER.label):
                chosen.append(kind.fit)
        return chosen

    def under(self, explanation: Explanation, effects: Sequence[Effect]) -> list[Explanation]:
        """Effects, the best form of each label, fitted under the noise of `explanation`, alone so far."""
        stochastic, host = explanation.stochastic, explanation.fit
        if stochastic is None or stochastic.display is not None or stochastic.beside is not None:
            return []
        screen = Screen(host, stochastic.whitener)
        forms = best_forms(self.each(screen.candidates, effects))
        ranked = [c[0] for c in forms if c[0].effect.label not in explanation.labels]

        starts = [joined(host, [candidate]) for candidate in ranked[:SCREENED_UNDER_NOISE]]
        return self.moved_from(explanation, starts, FINISHED_UNDER_NOISE)

    def moved_from(
        self, explanation: Explanation, starts: Sequence[tuple[Hypothesis, FloatArray]], finished: int
    ) -> list[Explanation]:
        """`moved` from the `finished` of `starts` that fit best after a few iterations."""

        def begun(start: tuple[Hypothesis, FloatArray]) -> Fit:
            return fit(start[0], self.measured, start[1], explanation.fit.whitener, ITERATIONS_AT_FIRST)

        first = sorted(self.each(begun, starts), key=lambda f: f.cost)
        return self.each(lambda f: self.moved(explanation, f.hypothesis, f.coordinates), first[:finished])

    def moved(self, explanation: Explanation, hypothesis: Hypothesis, start: FloatArray) -> Explanation:
        """`hypothesis` from `start` under the stochastic effect of `explanation`, both refitted."""
        stochastic = explanation.stochastic
        if stochastic is None:
            raise ValueError(f"{explanation.name} has no stochastic effect")
        if stochastic.display is not None:
            hypothesis = ShownHypothesis.of(hypothesis, stochastic.display)
        found = fit(hypothesis, self.measured, start, stochastic.whitener, ITERATIONS_UNDER_NOISE)
        host = self._as_measured(found)
        kind = OF_KEY.get((stochastic.label, stochastic.form), self._quantization)
        return self._refitted(kind, _again(kind, stochastic, host) or stochastic, host)

    def _as_measured(self, found: Fit) -> Fit:
        """The fit with the plain simulation in the place of what a display showed of it."""
        shown = found.hypothesis
        plain = Hypothesis(shown.builder, shown.scale, shown.inputs, shown.effects)
        simulated = plain.simulate(found.values)
        residuals = [y - s for y, s in zip(self.measured, simulated, strict=True)]
        return replace(found, hypothesis=plain, residuals=residuals, simulated=simulated)

    def _quantization(self, host: Fit) -> StochasticFit | None:
        return quantization(host, self.sigma)

    def _refitted(self, kind: FitNoise, first: StochasticFit, host: Fit) -> Explanation:
        best = with_stochastic(first, host)
        current, stochastic = host, first
        for _ in range(2):
            hypothesis = current.hypothesis
            if stochastic.display is not None:
                hypothesis = ShownHypothesis.of(hypothesis, stochastic.display)
            moved = fit(hypothesis, self.measured, current.coordinates, stochastic.whitener, 5)
            current = self._as_measured(moved)
            again = _again(kind, stochastic, current)
            if again is None:
                break
            stochastic = again
            trial = with_stochastic(stochastic, current)
            wandered = current.rmse > LARGEST_WANDER * host.rmse
            if wandered or trial.log_evidence < best.log_evidence + 1:
                break
            best = trial
        return best


def _likeliest(fits: Sequence[Fit], noise: Whitener) -> list[Fit]:
    """Those of `fits` whose residuals slow `noise` of another fit suits best; all, for other noise."""
    slow = noise.with_states
    if slow is None:
        return list(fits)
    return sorted(fits, key=lambda f: -slow.fitted_to(f.residuals).log_likelihood)[:FITTED_WITH_NOISE]


def _again(kind: FitNoise, found: StochasticFit, host: Fit) -> StochasticFit | None:
    """The same effect on the residuals of `host`, from where it was found."""
    return kind(host) if found.point is None else kind(host, found.point)
